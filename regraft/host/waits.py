"""What the threads of a process wait for without a fault of theirs, as Linux counts it."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

Waits = dict[str, float]


class Look:
    """One look at the waits of many: what is read for one is not read again for the next."""

    def __init__(self) -> None:
        """Nothing is read yet."""
        self.processor_wait = cache(processor_wait)
        self.waits_for_disk = cache(waits_for_disk)
        self.stolen = cache(stolen)


def processor_wait(pid: int) -> Waits:
    """Return the seconds that each thread of a process has waited for a processor, by thread; empty if unknown."""
    waited: Waits = {}
    try:
        for thread in os.listdir(f"/proc/{pid}/task"):
            waited[thread] = int(Path(f"/proc/{pid}/task/{thread}/schedstat").read_text().split()[1]) / 1e9
    except (OSError, IndexError, ValueError):
        return waited
    return waited


def waits_for_disk(pid: int) -> bool:
    """Tell whether a thread of a process is in uninterruptible sleep (state D); False if unknown."""
    try:
        for thread in os.listdir(f"/proc/{pid}/task"):
            state = Path(f"/proc/{pid}/task/{thread}/stat").read_text().rpartition(") ")[2][:1]
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
