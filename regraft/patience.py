"""Bounds of waits that last longer on a crowded machine: a process that waits for a processor is slow, not gone."""

from __future__ import annotations

import os
import time
from pathlib import Path

LOAD = Path("/proc/loadavg")
MAX_CROWDING = 20.0
"""Crowding beyond this is not made up for: every wait stays bounded."""
LOOK_INTERVAL = 0.05


def crowding() -> float:
    """Return how many threads want to run for each processor of this process now, at least 1; 1 if unknown."""
    try:
        runnable = int(LOAD.read_text().split()[3].partition("/")[0])
    except (OSError, IndexError, ValueError):
        return 1.0
    return min(MAX_CROWDING, max(1.0, runnable / len(os.sched_getaffinity(0))))


def stretched(seconds: float) -> float:
    """Return how long to wait, where the wait cannot look in between: ``seconds``, longer as crowded as it is now."""
    return seconds * crowding()


class Patience:
    """A bound in seconds that count in full only while every thread that wants to run does."""

    def __init__(self, seconds: float) -> None:
        self._left = seconds
        self._looked = time.monotonic()

    def is_over(self) -> bool:
        """Return whether the time is up; to be asked now and then during the wait."""
        now = time.monotonic()
        passed = now - self._looked
        if passed >= LOOK_INTERVAL or passed >= self._left:
            self._left -= passed / crowding()
            self._looked = now
        return self._left <= 0.0
