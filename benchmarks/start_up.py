"""Fifty trivial components up to the last liveliness token, against fifty bare zenoh processes.

A bare process is a fresh interpreter that imports zenoh, opens a client session to a hub that is already there, and
declares one token: ``python -c``, nothing of ours in it. So ours is judged from the moment at which the host,
whose hub is then there, starts the first process. What ``regraft up`` takes from the command on is told beside it.
"""

from __future__ import annotations

import queue
import subprocess
import sys
import time

from benchmarks.harness import Effort, Result, Sides, compared, in_turns
from benchmarks.sides.links import wait_until
from benchmarks.sides.system import SYSTEM, System
from regraft.bus.interface import Presence
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.keys import Keys
from regraft.system.launch import free_endpoint

COUNT, LEAST = 50, 3
ROUNDS = 3
LIMIT = 1.3
ALL_TIMEOUT = 60.0
TOPICS = "  numbers: {type: benchmark/Number, writers: many}"
BARE = """
import sys, threading, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("scouting/gossip/enabled", "false")
session = zenoh.open(config)
token = session.liveliness().declare_token(f"bare/{sys.argv[2]}")
threading.Event().wait()
"""


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


def _components(count: int) -> tuple[float, float]:
    """Return the seconds from the command, and from the first process's start, to the last token."""
    trivial = "{class: benchmarks.sides.counting:Trivial, connect: {out: numbers}}"
    specs = "".join(f"\n  trivial_{number}: {trivial}" for number in range(count))
    with System(TOPICS, specs) as system:
        bus = open_bus(system.info.hub)
        try:
            last = _when_all_are_there(bus, Keys(SYSTEM).alive("*", "*"), count)
        finally:
            bus.close()
        wait_until(lambda: len(system.processes()) == count, "the host has told of all processes")
        first = min(process.started for process in system.processes().values())
        since_first = time.time() - first
        return last - system.begun, last - (time.monotonic() - since_first)


def _bare(count: int) -> float:
    endpoint = free_endpoint()
    hub = open_bus(Endpoints((endpoint,), router=True))
    bus = open_bus(Endpoints(connect=(endpoint,)))
    processes: list[subprocess.Popen[bytes]] = []
    try:
        begun = time.monotonic()
        processes += [
            subprocess.Popen([sys.executable, "-P", "-c", BARE, endpoint, str(number)]) for number in range(count)
        ]
        return _when_all_are_there(bus, "bare/*", count) - begun
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()
        bus.close()
        hub.close()


def _when_all_are_there(bus: ZenohBus, key: str, count: int) -> float:
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
