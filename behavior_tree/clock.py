"""Where trees take the time from."""

import time
from typing import Protocol


class Clock(Protocol):
    """A source of time."""

    def now(self) -> float:
        """Return the time in seconds, from any fixed origin; it never decreases."""
        ...


class MonotonicClock:
    """The machine's monotonic clock."""

    def now(self) -> float:
        """Return the seconds since an arbitrary origin."""
        return time.monotonic()


class ManualClock:
    """A clock that is still until it is moved, for simulated time and for tests."""

    def __init__(self, start: float = 0.0) -> None:
        """Begin at a time in seconds."""
        self._now = start

    def now(self) -> float:
        """Return the time in seconds."""
        return self._now

    def advance_to(self, time_s: float) -> None:
        """Move to a later time in seconds.

        Raises:
            ValueError: The time lies in the past.
        """
        if time_s < self._now:
            raise ValueError(f"cannot move a clock back from {self._now} s to {time_s} s")
        self._now = time_s

    def advance(self, duration_s: float) -> None:
        """Move on by a duration in seconds."""
        self.advance_to(self._now + duration_s)
