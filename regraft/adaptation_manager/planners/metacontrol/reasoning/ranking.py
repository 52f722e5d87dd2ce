"""Designs in the order of their utility for an objective: what does not depend on the situation, computed once."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.model import (
    Design,
    Model,
    Objective,
    Quality,
    Requirement,
)
from regraft.adaptation_manager.planners.metacontrol.reasoning.utility import Utility

MAX_KEPT: Final = 200
"""Rankings that are kept. Those of 1,500 designs take some 150 KB each."""


@dataclass(frozen=True, slots=True)
class Ranking:
    """The designs of an objective's function in a context.

    ``designs`` are in the order of the files. ``fitting`` are those whose estimates meet all requirements, the most
    useful first; of equal ones, the first in the files.
    """

    designs: tuple[Design, ...]
    utility: Utility
    utilities: Mapping[str, float]
    fitting: tuple[str, ...]


class Rankings:
    """The rankings of a model's designs, which are kept for the next cycles."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._kept: dict[Hashable, Ranking] = {}
        self._designs: dict[tuple[str, str], tuple[Design, ...]] = {}

    def of(self, objective: Objective, context: str) -> Ranking:
        """Return the ranking for an objective without problems, in a context."""
        key = (
            objective.function,
            context,
            objective.requirements,
            None if objective.weights is None else tuple(objective.weights.items()),
            tuple((objective.curves or {}).items()),
        )
        ranking = self._kept.pop(key, None) or self._ranking(objective, context)
        self._kept[key] = ranking  # the one that was used last is the last
        if len(self._kept) > MAX_KEPT:
            del self._kept[next(iter(self._kept))]
        return ranking

    def _ranking(self, objective: Objective, context: str) -> Ranking:
        designs = self._of_function(objective.function, context)
        utility = Utility(objective, self.model.qualities)
        utilities = {each.name: utility.of(each) for each in designs}
        tests = [(self.model.qualities[each.quality], each) for each in objective.requirements]
        fitting = [each.name for each in designs if all(fits(each, quality, bound) for quality, bound in tests)]
        fitting.sort(key=lambda name: -utilities[name])  # sorting is stable
        return Ranking(designs, utility, utilities, tuple(fitting))

    def _of_function(self, function: str, context: str) -> tuple[Design, ...]:
        key = (function, context)
        if key not in self._designs:
            if len(self._designs) > MAX_KEPT:
                self._designs.clear()
            self._designs[key] = self.model.designs_of(function, context)
        return self._designs[key]


def fits(design: Design, quality: Quality, requirement: Requirement) -> bool:
    """Return whether the estimates of a design meet a requirement; one without an estimate does not."""
    value = design.estimates.get(requirement.quality)
    return value is not None and quality.meets(value, requirement.bound)
