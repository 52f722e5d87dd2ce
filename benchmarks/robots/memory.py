"""The memory of a trivial component beside that of a bare Zenoh process. For information.

The proportional set size counts a page that several processes share in parts. Components are forked from one process
and share what it has imported; bare processes share the libraries' files alone.
"""

from __future__ import annotations

import statistics

from benchmarks.harness import Effort, Result, compared, in_turns
from benchmarks.sides.bare import bare_processes
from benchmarks.sides.system import SYSTEM, System
from benchmarks.start_up import TOPICS, trivial_components, when_all_are_there
from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.keys import Keys
from regraft.host.watchdog.memory_use import proportional_size

COUNT, LEAST = 20, 3
ROUNDS = 3


def memory(effort: Effort) -> list[Result]:
    """Start so many of both, and look at each."""
    count, rounds = effort.count(COUNT, least=LEAST), min(ROUNDS, effort.rounds)
    sides = in_turns(rounds, lambda: [_of_components(count)], lambda: [_of_bare(count)])
    note = f"proportional set size, mean of {count} processes, {rounds} rounds"
    return [compared("memory of a trivial component", sides, "MiB", "a bare Zenoh process", None, note=note)]


def _of_components(count: int) -> float:
    with System(TOPICS, trivial_components(count)) as system:
        bus = open_bus(system.info.hub)
        try:
            when_all_are_there(bus, Keys(SYSTEM).alive("*", "*"), count)
        finally:
            bus.close()
        pids = [process.pid for process in system.processes().values() if process.pid]
        return _mean(pids)


def _of_bare(count: int) -> float:
    with bare_processes(count) as bare:
        when_all_are_there(bare.bus, "bare/*", count)
        return _mean([process.pid for process in bare.processes])


def _mean(pids: list[int]) -> float:
    return statistics.fmean(proportional_size(pid) for pid in pids)
