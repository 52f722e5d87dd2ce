"""Which frontier comes next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from regraft.services.explorer.frontiers import Frontier


@dataclass(frozen=True, slots=True)
class Weights:
    """The worth of a metre of frontier, and the cost of a metre of way to it."""

    gain: float = 1.0
    distance: float = 1.0


def best(frontier: Frontier, weights: Weights) -> float:
    """Return what looking there promises, less what the way costs."""
    return weights.gain * frontier.length - weights.distance * frontier.distance


def furthest(frontier: Frontier, weights: Weights) -> float:
    """Return how far away it is, as the original FROG chose."""
    return frontier.distance


STRATEGIES: dict[str, Callable[[Frontier, Weights], float]] = {"best": best, "furthest": furthest}


def choose(frontiers: Sequence[Frontier], strategy: str, weights: Weights) -> Frontier:
    """Return the frontier that a strategy values most; of equals the longest, then by place.

    Raises:
        KeyError: there is no such strategy.
        ValueError: there are no frontiers.
    """
    value = STRATEGIES[strategy]
    # Rounded, so that sums that differ in the last bit only are equals.
    return max(frontiers, key=lambda each: (round(value(each, weights), 6), each.length, each.target))
