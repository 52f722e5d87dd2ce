"""Waits of a process's threads that are no fault of theirs, as Linux counts them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path

Waits = dict[str, float]


class Look:
    """One look at the waits of many: what is read for one is not read again for the next."""

    def __init__(self, standing: OpenWaits | None = None) -> None:
        """Nothing is read yet; ``standing`` knows the look before."""
        self.processor_wait = cache(partial(processor_wait, standing=standing))
        self.waits_for_disk = cache(waits_for_disk)
        self.stolen = cache(stolen)


def processor_wait(pid: int, standing: OpenWaits | None = None) -> Waits:
    """Return the seconds that each thread of a process has waited for a processor, by thread; empty if unknown.

    The kernel counts a wait when it ends: one that lasts is counted by ``standing``.
    """
    waited: Waits = {}
    try:
        for thread in os.listdir(f"/proc/{pid}/task"):
            ran, waits = map(int, Path(f"/proc/{pid}/task/{thread}/schedstat").read_text().split()[:2])
            lasting = standing.seconds(f"{pid}/{thread}", ran, waits) if standing is not None else 0.0
            waited[thread] = waits / 1e9 + lasting
    except (OSError, IndexError, ValueError):
        return waited
    return waited


def _wants_to_run(task: str) -> bool:
    try:
        return (
            Path(f"/proc/{task.replace('/', '/task/')}/stat").read_text(errors="replace").rpartition(") ")[2][:1] == "R"
        )
    except OSError:
        return False


@dataclass(slots=True)
class OpenWaits:
    """Sees waits for a processor that have not ended: a thread that wants to run, and has not run since the last look.

    ``now`` is the time of the look, in monotonic seconds.
    """

    now: float = 0.0
    _since: dict[str, tuple[int, int, float]] = field(default_factory=dict)

    def seconds(self, task: str, ran: int, waited: int) -> float:
        """Return for how long a task has waited; ``ran`` and ``waited`` are what the kernel has counted."""
        before = self._since.get(task)
        if before is None or before[:2] != (ran, waited) or not _wants_to_run(task):
            self._since[task] = (ran, waited, self.now)
            return 0.0
        return self.now - before[2]

    def forget(self) -> None:
        """Begin again: nobody is silent."""
        self._since.clear()


def waits_for_disk(pid: int) -> bool:
    """Return whether a thread of a process is in uninterruptible sleep (state D); False if unknown."""
    try:
        for thread in os.listdir(f"/proc/{pid}/task"):
            state = Path(f"/proc/{pid}/task/{thread}/stat").read_text(errors="replace").rpartition(") ")[2][:1]
            if state == "D":
                return True
    except OSError:
        return False
    return False


def stolen() -> float:
    """Return the seconds for which this virtual machine's processors were taken from it, summed; 0 if unknown."""
    try:
        line = Path("/proc/stat").read_text().partition("\n")[0]
        return int(line.split()[8]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return 0.0
