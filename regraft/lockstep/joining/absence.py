"""Runs on other machines whose liveliness tokens have gone: with a broken link, or at the run's end."""

from __future__ import annotations

from regraft.bus.known_runs import Run
from regraft.patience import Patience

RETURN_TIMEOUT = 1.0
"""Seconds in which the token of a run on another machine may come back."""


class AbsentRuns:
    """The runs that may come back, each with the time that is left for it."""

    def __init__(self) -> None:
        self._left: dict[Run, Patience] = {}

    def went(self, run: Run) -> None:
        """Note that a run's token has gone."""
        self._left[run] = Patience(RETURN_TIMEOUT)

    def came_back(self, run: Run) -> bool:
        """Note that a run's token is there; returns whether it had gone."""
        return self._left.pop(run, None) is not None

    def take_ended(self) -> list[Run]:
        """Return the runs that have not come back in time, once each."""
        ended = sorted(run for run, left in self._left.items() if left.is_over())
        for run in ended:
            del self._left[run]
        return ended
