"""Conditions that must hold while an adaptation is being confirmed, and their breaches."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import Annotated, ClassVar

from regraft.bus_schema.annotations import Bounds, Count, OneOf, Seconds, Text, ToldBriefly
from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadCombination, BadMessage
from regraft.bus_schema.model.expression_kinds import kind_problems
from regraft.bus_schema.model.expressions import MAX_LENGTH, Expression
from regraft.bus_schema.model.lifecycle import LASTING, State

UNKNOWN_FOR = 3.0
"""Seconds for which a quality or an expression may be unknown where the request has no ``unknown_for``."""
KINDS = ("requirement", "quality", "component", "require")
"""The fields of which each condition has one."""
BOUNDS = ("at_least", "at_most", "within")
OF_KIND = {
    "requirement": (),
    "quality": (*BOUNDS, "unknown_for"),
    "component": ("state",),
    "require": ("unknown_for",),
}
"""The further fields that a condition of each kind may have."""


@dataclass(frozen=True, slots=True)
class Condition:
    """One of: a ``requirement`` is met; a ``quality`` is within bounds; a ``component`` is in a ``state``;
    an expression is true (``require``).

    A text alone is a requirement. ``quality`` is ``component.quality``, in the unit of its class. ``within`` is the
    least and the greatest value. ``require`` speaks of ``component.parameter``, ``component.quality`` and
    ``component.active``, as they are in the running components. ``unknown_for`` is how many seconds of the components'
    clock a quality or expression may be unknown.
    """

    shorthand: ClassVar[str] = "requirement"
    requirement: Annotated[str, Text(1000)] = ""
    quality: Annotated[str, Text(500)] = ""
    component: Annotated[str, Text(200)] = ""
    require: Annotated[str, Text(MAX_LENGTH)] = ""
    at_least: float | None = None
    at_most: float | None = None
    within: tuple[float, ...] = ()
    state: Annotated[State, OneOf(LASTING)] | None = None
    unknown_for: Annotated[Seconds, Bounds(0.0, 86_400.0)] | None = None

    def __post_init__(self) -> None:
        given = [kind for kind in KINDS if getattr(self, kind)]
        if len(given) != 1:
            has = " and ".join(given) or "none of them"
            raise BadCombination(f"must have one of {', '.join(KINDS)}; has {has}")
        (kind,) = given
        for other in fields(self):
            if other.name not in (kind, *OF_KIND[kind]) and getattr(self, other.name) != other.default:
                also = ", ".join(OF_KIND[kind]) or "nothing else"
                raise BadCombination(f"has no place next to {kind!r}, which takes {also}", (other.name,))
        self._check(kind)

    def _check(self, kind: str) -> None:
        if kind == "quality":
            if "." not in self.quality.strip("."):
                raise BadCombination(f"is {self.quality!r}, must be 'component.quality'", ("quality",))
            self._check_bounds()
        elif kind == "component" and self.state not in LASTING:
            problem = "is missing" if self.state is None else f"is {self.state.value!r}"
            states = ", ".join(state.value for state in LASTING)
            raise BadCombination(f"{problem}, must be one of: {states}", ("state",))
        elif kind == "require":
            try:
                expression = Expression(self.require)
            except BadMessage as error:
                raise BadCombination(error.why, ("require",)) from None
            bare = [name for name in expression.names if "." not in name]
            if bare or not expression.names:
                what = f"{bare[0]!r} is no" if bare else "speaks of no"
                raise BadCombination(
                    f"{what} 'component.parameter', 'component.quality' or 'component.active'", ("require",)
                )
            problems = kind_problems(expression, wanted=ValueKind.TRUTH)
            if problems:
                raise BadCombination("; ".join(problems), ("require",))

    def _check_bounds(self) -> None:
        if self.within and len(self.within) != 2:
            raise BadCombination(f"has {len(self.within)} numbers, must have two: [least, greatest]", ("within",))
        if self.within and (self.at_least is not None or self.at_most is not None):
            raise BadCombination("has no place next to at_least and at_most, which are the same", ("within",))
        least, most = self.bounds
        if least is None and most is None:
            raise BadCombination(f"must have bounds: {', '.join(BOUNDS)}")
        if least is not None and most is not None and least > most:
            field = "within" if self.within else "at_least"
            raise BadCombination(f"is {least:g}, must be at most the upper bound, {most:g}", (field,))

    @property
    def bounds(self) -> tuple[float | None, float | None]:
        """The least and the greatest value of the quality, None where there is none."""
        return (self.within[0], self.within[1]) if len(self.within) == 2 else (self.at_least, self.at_most)

    @property
    def kind(self) -> str:
        """Which of ``KINDS`` it has."""
        return next(kind for kind in KINDS if getattr(self, kind))

    @property
    def patience(self) -> float:
        """The seconds for which it may be unknown."""
        return UNKNOWN_FOR if self.unknown_for is None else self.unknown_for

    @property
    def wanted(self) -> str:
        """The value or state that it demands, in a few words."""
        if self.require:
            return self.require
        if self.state is not None:
            return self.state.value
        least, most = self.bounds
        words = [f"at least {least:g}" if least is not None else "", f"at most {most:g}" if most is not None else ""]
        return " and ".join(filter(None, words)) or "met"


class BreachCode(Enum):
    """The kinds of breaches while an adaptation is being confirmed."""

    ENDED = "ended"
    RESTARTED = "restarted"
    NO_ANSWER = "no_answer"
    WRONG_STATE = "wrong_state"
    ERROR_REPORTED = "error_reported"
    REQUIREMENT_BROKEN = "requirement_broken"
    REQUIREMENT_NOT_REPORTED = "requirement_not_reported"
    QUALITY_OUT_OF_BOUNDS = "quality_out_of_bounds"
    QUALITY_UNKNOWN = "quality_unknown"
    EXPRESSION_FALSE = "expression_false"
    EXPRESSION_UNKNOWN = "expression_unknown"
    INTERRUPTED = "interrupted"


@message("regraft/Breach")
@dataclass(frozen=True, slots=True)
class Breach:
    """One thing that did not hold while an adaptation was being confirmed.

    ``component`` is the component that it is about, if one alone is. ``watch`` is the index of the condition in the
    request, None for what is always watched. ``subject`` is its requirement, quality or expression. ``value`` is what
    was measured, None if that is unknown; ``wanted`` is what had to be so. ``at`` is when it was seen, by the manager's
    clock.
    """

    code: BreachCode
    text: ToldBriefly
    component: str = ""
    watch: Count | None = None
    subject: ToldBriefly = ""
    value: float | None = None
    wanted: ToldBriefly = ""
    at: Seconds = 0.0
