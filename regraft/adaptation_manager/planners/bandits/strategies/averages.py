"""How often options were credited, and the mean and spread of what they earned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.bandits.strategy import Decision, Offer
from regraft.bus_schema.annotations import PlainValue

MAX_KEPT: Final = 20_000
"""Options that are remembered; beyond it, those that were not credited for the longest time are forgotten."""
TRIES_WITHOUT_CREDIT: Final = 3
"""An option chosen so often without earning a credit is not tried first any more."""


@dataclass(slots=True)
class Average:
    """Mean of ``count`` utilities; ``squares`` is the sum of squared differences from it (Welford 1962)."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0

    def add(self, utility: float) -> None:
        """Take in one utility."""
        self.count += 1
        off = utility - self.mean
        self.mean += off / self.count
        self.squares += off * (utility - self.mean)

    @property
    def variance(self) -> float:
        """The mean squared difference from the mean."""
        return self.squares / self.count if self.count else 0.0


class Averages:
    """An average for each option that was credited."""

    def __init__(self) -> None:
        self._found: dict[str, Average] = {}

    def add(self, key: str, utility: float) -> None:
        """Take in what an option earned."""
        average = self._found.pop(key, None) or Average()
        average.add(utility)
        self._found[key] = average
        if len(self._found) > MAX_KEPT:
            del self._found[next(iter(self._found))]

    def of(self, key: str) -> Average:
        """Return an option's average; of none, if it was never credited."""
        return self._found.get(key) or Average()

    def state(self) -> PlainValue:
        """Return all of them as plain data."""
        return {key: [average.count, average.mean, average.squares] for key, average in self._found.items()}

    def restore(self, state: PlainValue) -> None:
        """Continue from what ``state`` returned."""
        self._found = {key: Average(*numbers) for key, numbers in state.items()}


def untried(offer: Offer, counts: Sequence[int]) -> Decision | None:
    """Return the option to try first: among those never credited the one chosen least often, in the order given.

    None if every option was credited, or chosen ``TRIES_WITHOUT_CREDIT`` times in vain.
    """
    tries = {index: offer.uncredited.get(offer.keys[index], 0) for index, n in enumerate(counts) if n == 0}
    if any(counts):
        tries = {index: n for index, n in tries.items() if n < TRIES_WITHOUT_CREDIT}
    return Decision(min(tries, key=lambda index: tries[index]), "not tried yet") if tries else None


def best(scores: Sequence[float]) -> int:
    """Return the index of the highest score, the first of equal ones."""
    return max(range(len(scores)), key=lambda index: scores[index])
