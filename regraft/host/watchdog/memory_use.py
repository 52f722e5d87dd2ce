"""How much memory the processes of each component have, counted often and cheaply.

The proportional set size counts, swap included: a page that several processes share counts a part in each. The
processes of all components share what the zygote has imported; their resident sizes would count it again for each. The
kernel walks through all pages to sum it up, 10 ms for a gigabyte. So the resident size, which is never less and costs
10 µs, is looked at first.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from regraft.process.descendants import RUN_VARIABLE, children_by_parent

FIND_INTERVAL = 0.2
"""Seconds after which the processes that a component has started are looked for again."""
SUM_UP_INTERVAL = 1.0
"""Seconds after which shared pages are counted again: their part grows when somebody who shares them ends."""
MEBIBYTE = 2.0**20


@dataclass(slots=True)
class _Run:
    """One run of a component. ``shared`` is how much its resident size was too high when it was summed up last."""

    processes: frozenset[int]
    shared: float = 0.0
    summed_up: float = float("-inf")

    def uses(self, now: float, allowed: float) -> float:
        """Return what it uses, in MiB; precise where it could be more than is allowed."""
        resident = sum(map(resident_size, self.processes))
        if resident <= allowed:
            return resident
        if resident - self.shared > allowed or now - self.summed_up >= SUM_UP_INTERVAL:
            proportional = sum(map(proportional_size, self.processes))
            self.shared, self.summed_up = max(0.0, resident - proportional), now
        return resident - self.shared


class MemoryUse:
    """The memory of many runs, look by look. Times are monotonic seconds."""

    def __init__(self, zygote: int) -> None:
        """Nothing is looked at yet; ``zygote`` is the process that adopts orphans."""
        self._zygote = zygote
        self._runs: dict[str, _Run] = {}
        self._next_search = 0.0

    def over(self, now: float, allowed: Mapping[str, tuple[int, float]]) -> dict[str, float]:
        """Return what those runs use, in MiB, that use more than is ``allowed``: their process, and how many MiB."""
        known = self._runs
        if now >= self._next_search or allowed.keys() != known.keys():
            self._next_search = now + FIND_INTERVAL
            found = self._search({run: pid for run, (pid, _) in allowed.items()})
            self._runs = {run: known.get(run) or _Run(frozenset()) for run in allowed}
            for run, processes in found.items():
                self._runs[run].processes = processes
        used = {run: self._runs[run].uses(now, memory) for run, (_, memory) in allowed.items()}
        return {run: memory for run, memory in used.items() if memory > allowed[run][1]}

    def _search(self, leaders: Mapping[str, int]) -> dict[str, frozenset[int]]:
        if not leaders:
            return {}
        found = {run: family(leader) for run, leader in leaders.items()}
        for adopted in _children(self._zygote) - set(leaders.values()):
            run = _run_of(adopted, leaders)
            if run is not None:
                found[run] |= family(adopted)
        return {run: frozenset(processes) for run, processes in found.items()}


def resident_size(pid: int) -> float:
    """Return a process's MiB in memory or swapped out, shared pages in full; 0 if it has ended."""
    try:
        text = Path(f"/proc/{pid}/status").read_text(errors="replace")
    except OSError:
        return 0.0
    return _sum(text.splitlines(), ("VmRSS:", "VmSwap:"))


def proportional_size(pid: int) -> float:
    """Return a process's MiB in memory or swapped out, with its part of shared pages; 0 if it has ended."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return resident_size(pid)  # before Linux 4.14, of another user's process, or of one that is gone
    return _sum(text.splitlines(), ("Pss:", "SwapPss:"))


def _sum(lines: Iterable[str], names: tuple[str, ...]) -> float:
    return sum(float(line.split()[1]) * 1024 / MEBIBYTE for line in lines if line.startswith(names))


def family(leader: int) -> set[int]:
    """Return a process and all below it."""
    found, waiting = {leader}, [leader]
    while waiting:
        below = _children(waiting.pop()) - found
        found |= below
        waiting += below
    return found


@cache
def _has_lists_of_children() -> bool:
    """Return whether this kernel lists the children of each thread; not all are built so."""
    return Path(f"/proc/self/task/{os.getpid()}/children").exists()


def _children(pid: int) -> set[int]:
    if not _has_lists_of_children():
        return set(children_by_parent().get(pid, ()))
    found: set[int] = set()
    with contextlib.suppress(OSError):  # it has ended, or this process may open no more files at this moment
        for thread in os.listdir(f"/proc/{pid}/task"):
            found |= set(map(int, Path(f"/proc/{pid}/task/{thread}/children").read_text().split()))
    return found


def _run_of(adopted: int, leaders: Mapping[str, int]) -> str | None:
    """Return the run that has started a process which has lost its parent, None if it does not show."""
    with contextlib.suppress(OSError, ProcessLookupError):
        group = os.getpgid(adopted)
        shown = Path(f"/proc/{adopted}/environ").read_bytes().split(b"\0")
        for run, leader in leaders.items():
            if group == leader or f"{RUN_VARIABLE}={run}".encode() in shown:
                return run
    return None
