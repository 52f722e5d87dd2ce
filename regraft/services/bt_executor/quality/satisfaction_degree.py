"""How far a number satisfies a bound or a fuzzy relation: a degree in [0, 1].

A degree of one half is where "satisfied" begins. The fuzzy relations are those of RELAX (Whittle et al., RE 2009). Its
requirements hold to a degree instead of yes or no.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

SATISFIED_FROM: Final = 0.5
"""The degree from which a requirement counts as satisfied."""

_DIGITS: Final = 9
"""Decimals of a degree: 0.26 - 0.18 is a little more than 0.08, and yet within 0.08."""


def at_least(value: float, bound: float, within: float) -> float:
    """Return 1 from the bound on and 0 below; with ``within``, rise from 0 to 1 between bound - and + within."""
    return _step(value >= bound) if within == 0.0 else _clamped(0.5 + (value - bound) / (2.0 * within))


def at_most(value: float, bound: float, within: float) -> float:
    """Return 1 up to the bound and 0 above; with ``within``, fall from 1 to 0 between bound - and + within."""
    return _step(value <= bound) if within == 0.0 else _clamped(0.5 + (bound - value) / (2.0 * within))


def close_to(value: float, target: float, within: float) -> float:
    """Return 1 at the target, one half at a distance of ``within``, and 0 from twice that on."""
    return _clamped(1.0 - abs(value - target) / (2.0 * within))


def _step(holds: bool) -> float:
    return 1.0 if holds else 0.0


def _clamped(degree: float) -> float:
    return round(min(max(degree, 0.0), 1.0), _DIGITS)


@dataclass(frozen=True, slots=True)
class Relation:
    """The relation that a number may be required to have.

    ``within_bound``: the tolerance is the bound itself unless another is given. A fuzzy relation without any bound
    needs one as its scale; ``needs_within``: one has to be given.
    """

    words: str
    degree: Callable[[float, float, float], float]
    within_bound: bool = False
    needs_within: bool = False

    @property
    def port(self) -> str:
        """The XML attribute that requires it."""
        return self.words.replace(" ", "_")

    def holds_to(self, value: float, bound: float, within: float | None) -> float:
        """Return the degree to which a value is as required.

        Raises:
            ValueError: a number is none, or the tolerance is impossible.
        """
        if within is None:
            within = bound if self.within_bound else 0.0
        if math.isnan(value) or not math.isfinite(bound):
            raise ValueError(f"'{self.words}' does not work on {value} and {bound}")
        needed = self.needs_within or self.within_bound
        if not 0.0 <= within < math.inf or (needed and within == 0.0):
            raise ValueError(f"'{self.words} {bound:g}' needs a tolerance 'within' above 0, not {within:g}")
        return self.degree(value, bound, within)


RELATIONS: Final = (
    Relation("at least", at_least),
    Relation("at most", at_most),
    Relation("as close as possible to", close_to, needs_within=True),
    Relation("as many as possible", at_least, within_bound=True),
    Relation("as few as possible", at_most, within_bound=True),
    Relation("as late as possible", at_least, within_bound=True),
    Relation("as early as possible", at_most, within_bound=True),
)
"""The number behind ``as many as possible`` is what will just do: there the degree is one half."""
