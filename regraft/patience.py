"""Bounds of waits that last longer on a crowded machine: a process that waits for a processor is slow, not gone."""

from __future__ import annotations

import os
import time

LOAD = "/proc/loadavg"
MAX_CROWDING = 20.0
"""Crowding beyond this is not made up for: every wait stays bounded."""
LOOK_INTERVAL = 0.05


def crowding() -> float:
    """Return how many threads want to run for each processor of this process now, at least 1; 1 if unknown."""
    try:
        with open(LOAD, "rb", buffering=0) as file:
            runnable = int(file.read(64).split()[3].partition(b"/")[0])
    except (OSError, IndexError, ValueError):
        return 1.0
    return min(MAX_CROWDING, max(1.0, runnable / len(os.sched_getaffinity(0))))


class _Recent:
    """The crowding of the last look. To look takes longer than to encode a query, and several are often sent at once.

    Threads may look at the same time: each leaves a pair that belongs together.
    """

    def __init__(self) -> None:
        self._seen = (0.0, float("-inf"))

    def crowding(self) -> float:
        """Return the crowding at most `LOOK_INTERVAL` ago."""
        crowded, looked = self._seen
        now = time.monotonic()
        if now - looked >= LOOK_INTERVAL:
            crowded = crowding()
            self._seen = crowded, now
        return crowded


_recent = _Recent()


def stretched(seconds: float) -> float:
    """Return how long to wait, where the wait cannot look in between: ``seconds``, longer as crowded as it is."""
    return seconds * _recent.crowding()


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
