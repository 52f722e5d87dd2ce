"""Epsilon-greedy: mostly the best so far, now and then any (Sutton & Barto, Reinforcement Learning, section 2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import Annotated

from regraft.adaptation_manager.planners.bandits.strategies.averages import TRIES_WITHOUT_CREDIT, best
from regraft.adaptation_manager.planners.bandits.strategies.averaging_strategy import Averaging
from regraft.adaptation_manager.planners.bandits.strategy import Decision, Knobs, Offer
from regraft.bus_schema.annotations import Bounds


@dataclass(frozen=True, slots=True)
class EpsilonKnobs(Knobs):
    """``epsilon`` is the probability of drawing any option; ``initial`` what an option counts for before its first
    credit, on the scale from 0 (``low``) to 1 (``high``): at 1 every option is tried once.
    """

    epsilon: Annotated[float, Bounds(0.0, 1.0)] = 0.1
    initial: Annotated[float, Bounds(0.0, 1.0)] = 1.0


class EpsilonGreedy(Averaging[EpsilonKnobs]):
    """Chooses the option with the best mean utility, but any option with the probability epsilon."""

    name = "epsilon_greedy"
    knobs_class = EpsilonKnobs

    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Draw whether to explore, then the option."""
        if rng.random() < self.knobs.epsilon:
            return Decision(rng.randrange(len(offer.keys)), "drawn at random, to explore")
        scores = [self._expected(key, offer) for key in offer.keys]
        index = best(scores)
        if not self.averages.of(offer.keys[index]).count:
            return Decision(index, "not tried yet")
        return Decision(index, f"best mean utility, {scores[index]:.4g} on a scale of 0 to 1")

    def _expected(self, key: str, offer: Offer) -> float:
        average = self.averages.of(key)
        if average.count:
            return average.mean
        return self.knobs.initial if offer.uncredited.get(key, 0) < TRIES_WITHOUT_CREDIT else -1.0
