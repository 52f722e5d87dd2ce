"""Which runs live, by their liveliness tokens: only a run that lives can join the clock."""

from __future__ import annotations

from bus_schema.messages.clock import Join

MOST_EARLY = 1000
"""Joins that may wait for the liveliness token of their run."""

Run = tuple[str, int]


class Living:
    """The tokens that are there, and the joins that came before their run's token; if none comes, they are forged."""

    def __init__(self) -> None:
        """Nobody lives."""
        self._runs: set[Run] = set()
        self._early: dict[Run, Join] = {}

    def admits(self, join: Join) -> bool:
        """Tell whether the run that asks lives; otherwise its join is kept until it does."""
        run = (join.member, join.incarnation)
        if run not in self._runs and len(self._early) < MOST_EARLY:
            self._early[run] = join
        return run in self._runs

    def appeared(self, run: Run) -> Join | None:
        """Note a token; returns the join that waited for it."""
        self._runs.add(run)
        return self._early.pop(run, None)

    def has(self, run: Run) -> bool:
        """Tell whether a run's token is there."""
        return run in self._runs

    def vanished(self, run: Run) -> None:
        """Note that a token has gone."""
        self._runs.discard(run)
