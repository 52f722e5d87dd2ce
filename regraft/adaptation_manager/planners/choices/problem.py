"""A choice as numbers alone: how many selections each slot has, which go together, and what they are worth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regraft.adaptation_manager.planners.choices.rules.rules import Rule

UNKNOWN = -math.inf
"""The worth of a combination about which nothing is known: it is not chosen."""


@dataclass(frozen=True, eq=False)
class Term:
    """A part of the objective that depends on some slots: its worth for each combination of their selections."""

    slots: tuple[int, ...]
    worth: NDArray[np.float64]

    def at(self, chosen: Sequence[int]) -> float:
        """Return the worth where ``chosen`` has a selection for every slot."""
        return float(self.worth[tuple(chosen[slot] for slot in self.slots)])


@dataclass(frozen=True, eq=False)
class Problem:
    """Slots by their numbers of selections, the rules to keep, and the terms whose sum is to be greatest."""

    sizes: tuple[int, ...]
    rules: tuple[Rule, ...] = ()
    terms: tuple[Term, ...] = ()

    @property
    def combinations(self) -> int:
        """How many combinations there are, those that break rules included."""
        return math.prod(self.sizes)

    def worth(self, chosen: Sequence[int]) -> float:
        """Return the objective of a combination."""
        return sum((term.at(chosen) for term in self.terms), 0.0)

    def keeps(self, chosen: Sequence[int]) -> bool:
        """Return whether a combination keeps all rules."""
        return all(rule.propagate([1 << selection for selection in chosen]) for rule in self.rules)
