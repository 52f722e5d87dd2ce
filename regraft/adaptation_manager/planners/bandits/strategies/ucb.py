"""Upper confidence bounds: UCB1 and UCB-Tuned (Auer, Cesa-Bianchi & Fischer, Machine Learning 47, 2002)."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from random import Random
from typing import Annotated

from regraft.adaptation_manager.planners.bandits.strategies.averages import Average, best, untried
from regraft.adaptation_manager.planners.bandits.strategies.averaging_strategy import Averaging
from regraft.adaptation_manager.planners.bandits.strategy import Decision, K, Knobs, Offer
from regraft.bus_schema.annotations import Bounds

MAX_VARIANCE = 0.25
"""No variable in [0, 1] varies more."""


class UpperBounds(Averaging[K]):
    """Every option once, then the one with the highest index: its mean and what it might be better by."""

    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Choose the highest index; ``n`` is the number of credits of all options on offer."""
        averages = [self.averages.of(key) for key in offer.keys]
        first = untried(offer, [average.count for average in averages])
        if first:
            return first
        n = sum(average.count for average in averages)
        scores = [self.index(average, n) if average.count else -math.inf for average in averages]
        chosen = best(scores)
        return Decision(chosen, f"best index, {scores[chosen]:.4g} with a mean of {averages[chosen].mean:.4g}")

    @abstractmethod
    def index(self, average: Average, n: int) -> float:
        """Return an option's index after ``n`` credits of all options."""


@dataclass(frozen=True, slots=True)
class Ucb1Knobs(Knobs):
    """``exploration`` widens the bound: 1 is Auer's, 0 chooses the best mean."""

    exploration: Annotated[float, Bounds(0.0, 100.0)] = 1.0


class Ucb1(UpperBounds[Ucb1Knobs]):
    """UCB1: mean + exploration * sqrt(2 ln n / n_k)."""

    name = "ucb1"
    knobs_class = Ucb1Knobs

    def index(self, average: Average, n: int) -> float:
        """Return UCB1's index (figure 1 of the paper)."""
        return average.mean + self.knobs.exploration * math.sqrt(2.0 * math.log(n) / average.count)


class UcbTuned(UpperBounds[Knobs]):
    """UCB-Tuned: mean + sqrt(ln n / n_k * min(1/4, s_k^2 + sqrt(2 ln n / n_k))), with the variance s_k^2."""

    name = "ucb_tuned"

    def index(self, average: Average, n: int) -> float:
        """Return UCB-Tuned's index (section 4 of the paper), with its cap of 1/4."""
        share = math.log(n) / average.count
        return average.mean + math.sqrt(share * min(MAX_VARIANCE, average.variance + math.sqrt(2.0 * share)))
