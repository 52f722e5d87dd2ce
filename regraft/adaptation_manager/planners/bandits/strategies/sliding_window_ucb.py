"""Sliding-window UCB, for worlds that change (Garivier & Moulines, ALT 2011)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from random import Random
from typing import Annotated, Final

from regraft.adaptation_manager.planners.bandits.strategies.averages import Averages, best, untried
from regraft.adaptation_manager.planners.bandits.strategy import Decision, Knobs, Offer, Strategy
from regraft.bus_schema.annotations import Bounds, PlainValue
from regraft.bus_schema.errors import BadMessage

MAX_WINDOW: Final = 10_000


@dataclass(frozen=True, slots=True)
class WindowKnobs(Knobs):
    """``window`` is how many of the latest credits count; ``xi`` widens the bound (0.6 in the paper's experiments)."""

    window: Annotated[int, Bounds(2, MAX_WINDOW)] = 50
    xi: Annotated[float, Bounds(0.0, 100.0)] = 0.6


class SlidingWindowUcb(Strategy[WindowKnobs]):
    """UCB over the latest credits only: mean + sqrt(xi ln min(n, window) / n_k), counted within the window."""

    name = "sliding_window_ucb"
    knobs_class = WindowKnobs

    def __init__(self, knobs: WindowKnobs) -> None:
        """Begin with an empty window."""
        super().__init__(knobs)
        self._latest: deque[tuple[str, float]] = deque(maxlen=MAX_WINDOW)

    def check(self, offer: Offer) -> None:
        """Refuse a window into which not every option fits: it would only ever try what it has just forgotten."""
        if self.knobs.window <= len(offer.keys):
            raise BadMessage(f"is {self.knobs.window}, must be more than the {len(offer.keys)} options", ("window",))

    def choose(self, offer: Offer, rng: Random) -> Decision:
        """Choose the highest index among the options on offer."""
        averages = Averages()
        for key, utility in list(self._latest)[-self.knobs.window :]:
            averages.add(key, utility)
        found = [averages.of(key) for key in offer.keys]
        first = untried(offer, [average.count for average in found])
        if first:
            return Decision(first.index, "not tried within the window")
        n = sum(average.count for average in found)
        scores = [
            average.mean + math.sqrt(self.knobs.xi * math.log(n) / average.count) if average.count else -math.inf
            for average in found
        ]
        chosen = best(scores)
        return Decision(chosen, f"best index, {scores[chosen]:.4g} with a mean of {found[chosen].mean:.4g}")

    def learn(self, key: str, utility: float, context: Mapping[str, float]) -> None:
        """Take a utility into the window."""
        self._latest.append((key, utility))

    def state(self) -> PlainValue:
        """Return the latest credits, as many as the window holds."""
        return [list(credit) for credit in list(self._latest)[-self.knobs.window :]]

    def restore(self, state: PlainValue) -> None:
        """Continue from the latest credits."""
        self._latest.clear()
        self._latest.extend((str(key), float(utility)) for key, utility in state)
