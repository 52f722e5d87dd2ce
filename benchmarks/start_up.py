"""Fifty trivial components up to the last liveliness token, against fifty bare zenoh processes.

A bare process is a fresh interpreter that imports zenoh, opens a client session to a hub that is already there, and
declares one token: ``python -c``, nothing of ours in it. So ours is judged from the moment at which the host,
whose hub is then there, starts the first process. What ``regraft up`` takes from the command on is told beside it.
"""

from __future__ import annotations

import queue
import time

from benchmarks.harness import Effort, Result, Sides, compared, in_turns
from benchmarks.sides.bare import bare_processes
from benchmarks.sides.links import wait_until
from benchmarks.sides.system import SYSTEM, System
from regraft.bus.interface import Presence
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus_schema.keys import Keys

COUNT, LEAST = 50, 3
ROUNDS = 3
LIMIT = 1.3
ALL_TIMEOUT = 60.0
TOPICS = "  numbers: {type: benchmark/Number, writers: many}"


def start_up(effort: Effort) -> list[Result]:
    """Start so many of both."""
    count = effort.count(COUNT, least=LEAST)
    rounds = min(ROUNDS, effort.rounds)
    from_command: list[list[float]] = []

    def ours() -> list[float]:
        command, host = _components(count)
        from_command.append([command])
        return [host]

    sides = in_turns(rounds, ours, lambda: [_bare(count)])
    against = f"{count} bare zenoh processes"
    name = f"{count} trivial components live"
    note = f"{rounds} rounds, from the first process's start to the last token"
    whole = Sides(list(from_command), sides.theirs)
    return [
        compared(name, sides, "s", against, LIMIT, note=note),
        compared(f"{name}, from the command", whole, "s", against, None, note="with the command line's start"),
    ]


def trivial_components(count: int) -> str:
    """Return so many trivial components, as a stack has them."""
    trivial = "{class: benchmarks.sides.counting:Trivial, connect: {out: numbers}}"
    return "".join(f"\n  trivial_{number}: {trivial}" for number in range(count))


def _components(count: int) -> tuple[float, float]:
    """Return the seconds from the command, and from the first process's start, to the last token."""
    with System(TOPICS, trivial_components(count)) as system:
        bus = open_bus(system.info.hub)
        try:
            last = when_all_are_there(bus, Keys(SYSTEM).alive("*", "*"), count)
        finally:
            bus.close()
        wait_until(lambda: len(system.processes()) == count, "the host has told of all processes")
        first = min(process.started for process in system.processes().values())
        since_first = time.time() - first
        return last - system.begun, last - (time.monotonic() - since_first)


def _bare(count: int) -> float:
    with bare_processes(count) as bare:
        return when_all_are_there(bare.bus, "bare/*", count) - bare.begun


def when_all_are_there(bus: ZenohBus, key: str, count: int) -> float:
    """Return the time at which the last of ``count`` tokens appeared; raises TimeoutError."""
    seen: queue.Queue[tuple[float, Presence]] = queue.Queue()
    watching = bus.watch(key, lambda presence: seen.put((time.monotonic(), presence)))
    keys: set[str] = set()
    try:
        while True:
            when, presence = seen.get(timeout=ALL_TIMEOUT)
            keys.add(presence.key)
            if len(keys) == count:
                return when
    except queue.Empty:
        raise TimeoutError(f"{len(keys)} of {count} tokens within {ALL_TIMEOUT:g} s") from None
    finally:
        watching.close()
