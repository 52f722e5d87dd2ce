"""Why something was chosen: what was excluded and why, what came close, what is predicted, whether that is proven."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from regraft.adaptation_manager.planners.choices.problem import UNKNOWN, Problem
from regraft.adaptation_manager.planners.choices.rules.allowed_combinations import Search, TooHard
from regraft.adaptation_manager.planners.choices.rules.rules import Clause
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.bus_schema.annotations import PlainValue

MEASURED: Final = "measured"
ESTIMATED: Final = "estimated"
UNKNOWN_SOURCE: Final = "unknown"
TOGETHER: Final = "the constraints together"


@dataclass(frozen=True, slots=True)
class Exclusion:
    """An alternative that could not be chosen, and why."""

    slot: str
    alternative: PlainValue
    why: str


@dataclass(frozen=True, slots=True)
class RunnerUp:
    """A combination that was not chosen: its alternatives by slot, and its utility."""

    values: tuple[PlainValue, ...]
    utility: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """A quality as it is under the present choice, and expected to be under the new one; None if unknown.

    ``before_from`` and ``after_from`` name how each is known: ``measured``, ``estimated`` or ``unknown``.
    """

    name: str
    before: Any
    after: Any
    before_from: str
    after_from: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why something was chosen.

    ``standing`` is the utility of the present choice. ``unknown`` is what could not be worked out, ``nothing`` why
    nothing was chosen. ``gap`` is how much better something else may be. ``steps`` are repeatable, ``seconds`` are
    those of the processor.
    """

    solver: str
    combinations: int
    excluded: tuple[Exclusion, ...]
    runners_up: tuple[RunnerUp, ...]
    predicted: tuple[Prediction, ...]
    standing: float | None
    unknown: tuple[str, ...]
    nothing: str
    proven: bool
    gap: float
    steps: int
    seconds: float


def exclusions(slots: Sequence[Slot], problem: Problem, texts: Sequence[str]) -> tuple[Exclusion, ...]:
    """Return the alternatives that no combination can have, each with the first reason that there is."""
    return tuple(_exclusions(slots, problem, texts))


def _exclusions(slots: Sequence[Slot], problem: Problem, texts: Sequence[str]) -> Iterator[Exclusion]:
    try:
        left = Search(problem.sizes, range(len(slots)), problem.rules).reduced()
    except TooHard:
        left = None
    for index, slot in enumerate(slots):
        every = (1 << problem.sizes[index]) - 1
        for number, alternative in enumerate(slot.alternatives):
            having = slot.with_alternatives(1 << number)
            why = _direct_reason(index, having, problem, texts)
            if not why and left is not None and having & every and not having & left[index]:
                why = TOGETHER
            if why:
                yield Exclusion(slot.name, alternative.name, why)


def _direct_reason(slot: int, having: int, problem: Problem, texts: Sequence[str]) -> str:
    for rule in problem.rules:
        if isinstance(rule, Clause) and rule.scope() == (slot,) and not having & rule.ways[0][1]:
            return texts[rule.source]
    for term in problem.terms:
        if term.slots == (slot,) and all(
            term.worth[i] == UNKNOWN for i in range(problem.sizes[slot]) if having >> i & 1
        ):
            return "what it is worth is not known"
    return ""
