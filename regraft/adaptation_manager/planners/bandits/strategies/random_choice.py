"""Any option, as likely as any other."""

from __future__ import annotations

from collections.abc import Mapping
from random import Random

from regraft.adaptation_manager.planners.bandits.strategy import Decision, Knobs, Offer, Strategy
from regraft.bus_schema.annotations import PlainValue


class RandomChoice(Strategy[Knobs]):
    """Chooses any option with the same probability, and learns nothing: what others are compared with."""

    name = "random"

    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Draw an option."""
        return Decision(rng.randrange(len(offer.keys)), "drawn at random")

    def learn(self, key: str, utility: float, context: Mapping[str, float]) -> None:
        """Learn nothing."""

    def state(self) -> PlainValue:
        """Return nothing."""
        return {}

    def restore(self, state: PlainValue) -> None:
        """Continue from nothing."""
