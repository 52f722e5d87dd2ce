"""Which runs live, by their liveliness tokens: only a run that lives can join the clock, and only alone."""

from __future__ import annotations

from collections.abc import Iterable

from regraft.bus.known_runs import Run
from regraft.bus_schema.messages.protocol.clock import Join

MAX_EARLY = 1000
"""Joins that may wait for the liveliness token of their run."""


class LivenessTracker:
    """The tokens that are there, and the joins that came too early: before their run's token, or while the run that
    is the member lives. A forged one waits for ever.
    """

    def __init__(self) -> None:
        self._runs: set[Run] = set()
        self._early: dict[Run, Join] = {}

    def admits(self, join: Join, former: Iterable[int]) -> bool:
        """Return whether the run that asks lives, and no ``former`` one; else its join is kept until that is so."""
        run = (join.member, join.incarnation)
        admitted = run in self._runs and not any(n < run[1] and (join.member, n) in self._runs for n in former)
        if not admitted and len(self._early) < MAX_EARLY:
            self._early[run] = join
        return admitted

    def appeared(self, run: Run) -> Join | None:
        """Note a token; returns the join that waited for it."""
        self._runs.add(run)
        return self._early.pop(run, None)

    def waiting(self, run: Run) -> Join | None:
        """Return the waiting join of a living run, for callers that know that the older one is to end."""
        return self._early.pop(run, None) if run in self._runs else None

    def has(self, run: Run) -> bool:
        """Return whether a run's token is there."""
        return run in self._runs

    def vanished(self, run: Run) -> list[Join]:
        """Note that a token has gone; returns the joins that may have waited for that."""
        self._runs.discard(run)
        waited = [other for other in self._early if other[0] == run[0] and other in self._runs]
        return [self._early.pop(other) for other in sorted(waited)]
