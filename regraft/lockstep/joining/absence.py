"""Runs on other machines whose liveliness tokens have gone: with a broken link, or at the run's end."""

from __future__ import annotations

import time

from regraft.lockstep.joining.liveness import Run

RETURN_TIMEOUT = 1.0
"""Seconds in which the token of a run on another machine may come back."""


class AbsentRuns:
    """The runs that may come back, each with its deadline (monotonic seconds)."""

    def __init__(self) -> None:
        self._until: dict[Run, float] = {}

    def went(self, run: Run) -> None:
        """Note that a run's token has gone."""
        self._until[run] = time.monotonic() + RETURN_TIMEOUT

    def came_back(self, run: Run) -> bool:
        """Note that a run's token is there; returns whether it had gone."""
        return self._until.pop(run, None) is not None

    def take_ended(self) -> list[Run]:
        """Return the runs that have not come back in time, once each."""
        now = time.monotonic()
        ended = sorted(run for run, until in self._until.items() if until <= now)
        for run in ended:
            del self._until[run]
        return ended
