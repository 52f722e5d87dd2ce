"""Simulated time without a world."""

from __future__ import annotations

from regraft.lockstep.source import TimeSource


class Clock(TimeSource):
    """Makes time continue, and simulates nothing: all that happens is in the stubs."""

    def advance(self, tick: int, seconds: float) -> None:
        """Do nothing but let the tick pass."""
