"""Time as components see it, in nanoseconds: it never goes back."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Reports the time of the stack, real or simulated."""

    def now(self) -> int:
        """Return the time in nanoseconds."""


OFFSET = time.time_ns() - time.monotonic_ns()
"""Taken before a host forks its components: all of them have one time, also those that start after a clock was set."""


class RealClock:
    """Wall-clock time since 1970 as it was when the host started, moved on by the monotonic clock."""

    def now(self) -> int:
        """Return the time in nanoseconds."""
        return time.monotonic_ns() + OFFSET


class SteppedClock:
    """Time that moves only when it is asked to: simulated time, and time in tests."""

    def __init__(self, start: int = 0) -> None:
        """Begin at ``start`` nanoseconds."""
        self._now = start

    def now(self) -> int:
        """Return the time in nanoseconds."""
        return self._now

    def advance_to(self, then: int) -> None:
        """Move to ``then``; an earlier time is ignored, time never goes back."""
        self._now = max(self._now, then)
