"""A component is moved to a second host and back, at a thousand messages a second."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from benchmarks.harness import Effort, Result
from benchmarks.sides.ear import COMPONENTS, TOPICS, Handed, heard, results
from benchmarks.sides.links import wait_until
from benchmarks.sides.system import MANAGER, ROOT, System
from regraft.bus.zenoh_config import config
from regraft.bus_schema.model.adaptation import Move
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.process.own_python import own_environment, own_python

MOVES = 40
EDGE, HOME = "edge", "local"
END_TIMEOUT = 20.0


def move(effort: Effort) -> list[Result]:
    """Move a relay there and back again and again; by hand there is nothing that could be compared with it."""
    with System(TOPICS, COMPONENTS + MANAGER, hosts=(EDGE,)) as system, _second_host(system):
        system.wait_for_components("talker", "relay", "adaptation_manager")
        session = zenoh.open(config(system.info.hub, lockstep=False))
        try:
            with heard(session, "passed") as ear:
                both = [
                    ear.around(lambda host=host: system.adapt(Move("relay", host)))  # type: ignore[misc]
                    for host in (EDGE, HOME) * effort.count(MOVES // 2, least=1)
                ]
            moved = Handed.of(both, ear)
        finally:
            session.close()  # type: ignore[no-untyped-call]
    return list(results("move to another host", moved, None, None, 0))


@contextmanager
def _second_host(system: System) -> Iterator[None]:
    """Have a second host join, and end it as Ctrl-C does."""
    command = ["host", "--join", system.info.endpoint, "--name", EDGE]
    process = subprocess.Popen(
        own_python("-m", "regraft.cli", *command),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        stdin=subprocess.DEVNULL,
        cwd=ROOT,
        env=own_environment(),
    )
    try:
        wait_until(lambda: system.client.hosts()[EDGE].state is HostState.JOINED, "the second host has joined")
        yield
    finally:
        process.terminate()
        try:
            process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
