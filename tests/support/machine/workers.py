"""How many processes run the tests: as many as the machine's processors and its memory, or the container's, allow."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from pathlib import Path

CONTROL_GROUPS = Path("/sys/fs/cgroup")
PER_PROCESSOR = 2
"""Most tests wait for other processes."""
BYTES_EACH = 5 * 2**28
"""A worker has up to 0.5 GB, and a whole FROG beside it as much again."""
MOST = 8


def workers() -> int:
    """Return how many processes run the tests."""
    by_processors = PER_PROCESSOR * len(os.sched_getaffinity(0))
    return max(1, min(MOST, by_processors, memory() // BYTES_EACH))


def give_back_memory() -> None:
    """Have the C library give the system back what is free: a worker would come to hold twice what it needs."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def memory() -> int:
    """Return the bytes of memory that this process and its children may use."""
    physical = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return min((physical, *_limits()))


def _limits() -> Iterator[int]:
    """Yield the limits of this process's control group, of either version, seen from outside or inside a container."""
    for line in Path("/proc/self/cgroup").read_text().splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers and "memory" not in controllers.split(","):
            continue
        folder, name = ("memory", "memory.limit_in_bytes") if controllers else ("", "memory.max")
        for group in (path.lstrip("/"), ""):
            file = CONTROL_GROUPS / folder / group / name
            text = file.read_text().strip() if file.is_file() else ""
            if text.isdigit():
                yield int(text)
