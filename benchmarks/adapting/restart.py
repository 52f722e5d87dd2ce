"""A component is killed until it is active again; another hangs until it is found. The host is the real one.

Every victim is killed once: its host waits before each restart (0.05 s before the first, doubled for each further
one in half a minute), and that belongs to the figure. The baseline forks at once.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
import time

from benchmarks.harness import Effort, Result, Sides, compared, percentile
from benchmarks.sides.links import wait_until
from benchmarks.sides.processes import Processes
from benchmarks.sides.respawn import ALIVE, respawner
from benchmarks.sides.system import SYSTEM, System
from regraft.bus.interface import Presence
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.model.lifecycle import State

KILLS, HANGS = 24, 5
KILL_LIMIT, HANG_LIMIT = 0.3, 0.6
TAIL = 0.95
BACK_TIMEOUT = 20.0
TOPICS = "  numbers: {type: benchmark/Number, writers: many}"


def restart(effort: Effort) -> list[Result]:
    """Kill, and stop."""
    kills, hangs = effort.count(KILLS, least=2), effort.count(HANGS)
    names = [f"victim_{number}" for number in range(kills + hangs)]
    specs = "".join(
        f"\n  {name}: {{class: benchmarks.sides.counting:Trivial, connect: {{out: numbers}}}}" for name in names
    )
    with System(TOPICS, specs) as system, Processes() as processes:
        system.wait_for_components(*names)
        wait_until(lambda: all(p.pid for p in system.processes().values()), "all processes told of")
        bus = open_bus(system.info.hub)
        try:
            back = _kill(system, bus, processes, names[:kills])
            found = [_stop(system, name) for name in names[kills:]]
        finally:
            bus.close()
    return [
        Result(
            "kill -9 to active again, p95",
            percentile(back.ours[0], TAIL),
            "s",
            limit=KILL_LIMIT,
            spread=(min(back.ours[0]), max(back.ours[0])),
            note=f"{kills} kills; 0.05 s of it is the wait before a restart",
        ),
        compared("the same, ratio", back, "s", "fork + zenoh open", None, share=TAIL, note="p95"),
        Result(
            "hung component found, worst",
            max(found),
            "s",
            limit=HANG_LIMIT,
            spread=(min(found), max(found)),
            note=f"{hangs} stopped with SIGSTOP",
        ),
    ]


def _kill(system: System, bus: ZenohBus, processes: Processes, names: list[str]) -> Sides:
    """Kill a component and a bare process in turns; returns the seconds until each was back."""
    statuses: queue.Queue[ComponentStatus] = queue.Queue()
    tokens: queue.Queue[Presence] = queue.Queue()

    def take(item: object) -> None:
        sample = bus.open_sample(item)
        if sample is not None and sample.payload:
            statuses.put(codec.decode(sample.payload, ComponentStatus))

    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    subscription = bus.subscribe(Keys(SYSTEM).status("*"), take)
    watching = bus.watch(f"{ALIVE}/*", tokens.put)
    processes.spawn(respawner, system.info.hub, theirs, len(names) + 1)
    _wait_for_token(tokens, 0)
    pids = {name: process.pid for name, process in system.processes().items()}
    back_ours: list[float] = []
    back_theirs: list[float] = []
    for number, name in enumerate(names):
        begun = time.monotonic()
        os.kill(pids[name], signal.SIGKILL)
        _wait_for_active(statuses, name, incarnation=2)
        back_ours.append(time.monotonic() - begun)
        pid = ours.recv()
        begun = time.monotonic()
        os.kill(pid, signal.SIGKILL)
        _wait_for_token(tokens, number + 1)
        back_theirs.append(time.monotonic() - begun)
    os.kill(ours.recv(), signal.SIGKILL)
    subscription.close()
    watching.close()
    return Sides([back_ours], [back_theirs])


def _wait_for_active(statuses: queue.Queue[ComponentStatus], name: str, incarnation: int) -> None:
    while True:
        status = statuses.get(timeout=BACK_TIMEOUT)
        if status.component == name and status.incarnation >= incarnation and status.state is State.ACTIVE:
            return


def _wait_for_token(tokens: queue.Queue[Presence], number: int) -> None:
    while True:
        presence = tokens.get(timeout=BACK_TIMEOUT)
        if presence.present and presence.key == f"{ALIVE}/{number}":
            return


def _stop(system: System, name: str) -> float:
    """Stop a component; returns the seconds until its host said that it hangs."""
    begun = time.monotonic()
    os.kill(system.processes()[name].pid, signal.SIGSTOP)

    def said() -> list[float]:
        return [when for when, event in list(system.events) if event.kind == "component.hung" and event.subject == name]

    wait_until(said, f"{name} found hung", BACK_TIMEOUT)
    return said()[0] - begun
