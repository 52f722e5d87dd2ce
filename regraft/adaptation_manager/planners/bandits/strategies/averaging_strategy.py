"""The base of strategies that keep one average per option."""

from __future__ import annotations

from collections.abc import Mapping

from regraft.adaptation_manager.planners.bandits.strategies.averages import Averages
from regraft.adaptation_manager.planners.bandits.strategy import K, Strategy
from regraft.bus_schema.annotations import PlainValue


class Averaging(Strategy[K]):
    """A strategy whose knowledge is an average per option."""

    def __init__(self, knobs: K) -> None:
        super().__init__(knobs)
        self.averages = Averages()

    def learn(self, key: str, utility: float, context: Mapping[str, float]) -> None:
        """Take a utility into the option's average."""
        self.averages.add(key, utility)

    def state(self) -> PlainValue:
        """Return the averages."""
        return self.averages.state()

    def restore(self, state: PlainValue) -> None:
        """Continue from averages."""
        self.averages.restore(state)
