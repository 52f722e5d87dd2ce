"""Thompson sampling with Beta posteriors (Thompson 1933; Agrawal & Goyal, COLT 2012)."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import Annotated

from regraft.adaptation_manager.planners.bandits.strategies.averages import best
from regraft.adaptation_manager.planners.bandits.strategies.averaging_strategy import Averaging
from regraft.adaptation_manager.planners.bandits.strategy import Decision, Knobs, Offer
from regraft.bus_schema.annotations import Bounds


@dataclass(frozen=True, slots=True)
class ThompsonKnobs(Knobs):
    """``prior`` is both parameters of the Beta prior: 1 takes any mean utility for equally likely."""

    prior: Annotated[float, Bounds(0.01, 1000.0)] = 1.0


class Thompson(Averaging[ThompsonKnobs]):
    """Draws every option's worth from Beta(prior + sum of u, prior + sum of 1 - u), and chooses the highest draw.

    For utilities that are 0 or 1 this is the exact posterior. For those between it is wider than it need be, so that it
    explores rather more than less.
    """

    name = "thompson"
    knobs_class = ThompsonKnobs

    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Draw for each option, in the order given."""
        draws = []
        for key in offer.keys:
            average = self.averages.of(key)
            won = average.mean * average.count
            draws.append(rng.betavariate(self.knobs.prior + won, self.knobs.prior + max(0.0, average.count - won)))
        chosen = best(draws)
        average = self.averages.of(offer.keys[chosen])
        return Decision(chosen, f"highest draw, {draws[chosen]:.4g}, after {average.count} credits")
