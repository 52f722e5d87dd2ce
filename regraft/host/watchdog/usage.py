"""Measures what the processes of a host take, whenever somebody asks."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from regraft.bus_schema.messages.protocol.usage import HostUsage, RunUsage
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.watchdog.memory_use import MEBIBYTE, family, proportional_size

WINDOW = 0.5
"""Seconds over which processor time is averaged at the least."""
TICKS = os.sysconf("SC_CLK_TCK")
UTIME, STIME, STARTED = 11, 12, 19
"""Fields of ``/proc/PID/stat`` behind the name of the program, from 0 (proc(5)); times are in ticks."""


@dataclass(frozen=True, slots=True)
class _Sample:
    at: float
    seconds: float
    rate: float


class Usage:
    """The use of one host, question by question."""

    def __init__(self) -> None:
        self._samples: dict[str, _Sample] = {}

    def measure(self, host: str, processes: Iterable[ManagedProcess]) -> HostUsage:
        """Return what processes take now; one that has just ended takes nothing."""
        now, found, samples = time.clock_gettime(time.CLOCK_BOOTTIME), dict[str, RunUsage](), dict[str, _Sample]()
        for managed in processes:
            if not managed.pid:
                continue
            pids = family(managed.pid)
            samples[managed.run] = sample = self._sample(managed.run, managed.pid, pids, now)
            memory = sum(map(proportional_size, pids))
            before = found.get(managed.spec.name, RunUsage(0.0, 0.0))
            found[managed.spec.name] = RunUsage(before.cpu + sample.rate, before.memory + memory)
        self._samples = samples
        total, available = _machine()
        return HostUsage(host, len(os.sched_getaffinity(0)), total, available, found)

    def _sample(self, run: str, leader: int, pids: set[int], now: float) -> _Sample:
        before = self._samples.get(run)
        if before is not None and now - before.at < WINDOW:
            return before
        stats = {pid: _stat(pid) for pid in pids}
        seconds = sum((int(stat[UTIME]) + int(stat[STIME])) / TICKS for stat in stats.values() if stat)
        if before is None:
            own = stats.get(leader)
            before = _Sample(int(own[STARTED]) / TICKS if own else now, 0.0, 0.0)
        # A process that the component had started may have ended, and takes its seconds with it.
        rate = max(0.0, seconds - before.seconds) / (now - before.at) if now > before.at else 0.0
        return _Sample(now, seconds, rate)


def _stat(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(") ")[2].split()
    except OSError:
        return []


def _machine() -> tuple[float, float]:
    """Return the MiB that the machine has, and those that are available."""
    lines = Path("/proc/meminfo").read_text().splitlines()
    sizes = {
        name: float(rest.split()[0]) * 1024 / MEBIBYTE for name, _, rest in (line.partition(":") for line in lines)
    }
    return sizes["MemTotal"], sizes.get("MemAvailable", sizes["MemFree"])
