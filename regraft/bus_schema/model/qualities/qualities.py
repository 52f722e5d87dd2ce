"""Qualities of components: how a class declares them, and which of the values that it gives count."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from numbers import Real

from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.suggestions import instead_of

MAX_UNDECLARED = 8
"""Names that a class has not declared, of those that are reported."""
MAX_NAME = 200
NOT_GIVEN, ONLY_MEASURED = "not given", "only measured"
"""Why a declared quality has no value, where nothing is wrong."""


class Better(Enum):
    """Whether more of a quality is better, or less."""

    HIGHER = "higher"
    LOWER = "lower"
    NEITHER = "neither"


@message("regraft/QualityDescription")
@dataclass(frozen=True, slots=True)
class QualityDescription:
    """A quality of a component: its unit, which direction is better, its range, and who gives it.

    A ``functional`` quality is about what the component does, another one about how well or at what cost.
    It is ``measured`` by ``evaluate`` and ``estimated`` by ``estimate``.
    """

    name: str
    unit: str = "1"
    better: Better = Better.NEITHER
    minimum: float | None = None
    maximum: float | None = None
    functional: bool = False
    measured: bool = True
    estimated: bool = True
    description: str = ""

    def problem(self, value: object) -> str:
        """Return why a value cannot be one of this quality; empty if it can."""
        if type(value) is float:  # nearly always: to ask an abstract class takes longer than all the rest
            number = value
        elif isinstance(value, bool) or not isinstance(value, Real):
            return f"a value of type {type(value).__name__}: must be a number"
        else:
            number = float(value)
        if not math.isfinite(number):
            return f"{number}: must be finite"
        if self.minimum is not None and number < self.minimum:
            return f"{number:g}: must be at least {self.minimum:g} {self.unit}"
        if self.maximum is not None and number > self.maximum:
            return f"{number:g}: must be at most {self.maximum:g} {self.unit}"
        return ""


@dataclass(frozen=True, slots=True)
class Judged:
    """The values that count, by quality, and why others do not.

    ``unknown`` is why a declared quality has no value, ``undeclared`` is what was given, or failed, under other names.
    """

    values: dict[str, float]
    unknown: dict[str, str]
    undeclared: dict[str, str]

    @property
    def problems(self) -> dict[str, str]:
        """The reasons for what was given and does not count; a quality that is only left out is no problem."""
        given = {name: why for name, why in self.unknown.items() if why != NOT_GIVEN}
        return given | self.undeclared


def measured(described: Iterable[QualityDescription]) -> tuple[QualityDescription, ...]:
    """Return the qualities that ``evaluate`` gives."""
    return tuple(quality for quality in described if quality.measured)


def estimated(described: Iterable[QualityDescription]) -> tuple[QualityDescription, ...]:
    """Return the qualities that ``estimate`` gives."""
    return tuple(quality for quality in described if quality.estimated)


def judged(described: Iterable[QualityDescription], given: object, failed: Mapping[str, str] | None = None) -> Judged:
    """Return what of the ``given`` values counts; nothing is raised, for any value that a class returns.

    ``failed`` is why there are no values under some names.
    """
    declared = {quality.name: quality for quality in described}
    if not isinstance(given, Mapping):
        why = f"a value of type {type(given).__name__} for all: must be a map of numbers by name"
        return Judged({}, dict.fromkeys(declared, why), {})
    values: dict[str, float] = {}
    unknown: dict[str, str] = {}
    failed = failed or {}
    for name, quality in declared.items():
        problem = quality.problem(given[name]) if name in given else failed.get(name, NOT_GIVEN)
        if problem:
            unknown[name] = problem
        else:
            values[name] = float(given[name])
    others = [str(name)[:MAX_NAME] for name in given if name not in declared][:MAX_UNDECLARED]
    undeclared = {name: f"not declared; {instead_of(name, declared)}" for name in others}
    return Judged(values, unknown, undeclared | {name: why for name, why in failed.items() if name not in declared})


def all_unknown(described: Iterable[QualityDescription], why: str) -> Judged:
    """Return that nothing is known, and why."""
    return Judged({}, {quality.name: why for quality in described}, {})
