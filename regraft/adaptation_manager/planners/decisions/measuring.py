"""The worth of a choice: the mean of the measured utility while it was in force."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from regraft.adaptation_manager.planners.choices.estimates import NoEstimates
from regraft.adaptation_manager.planners.choices.objective import Evaluation, Objective
from regraft.adaptation_manager.planners.choices.slots import option_of
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.expressions import Unknown

SAMPLE_EVERY: Final = 0.25
"""Seconds."""


def measured_utility(decision: Decision, selections: Sequence[int], situation: Mapping[str, Any]) -> float:
    """Return the utility of a choice by what is measured; raises Unknown."""
    objective = Objective(decision.utility, named=decision.measured())
    evaluation = Evaluation(decision.slots, objective, situation, NoEstimates())
    return evaluation.value(decision.utility, selections)


def meaning_of(decision: Decision, selections: Sequence[int]) -> str:
    """Return a text that is equal for choices that set the same and have the same measure of utility."""
    chosen = [
        (slot, index)
        for slot, number in zip(decision.slots, selections, strict=True)
        for index in slot.selections[number]
    ]
    figures = [sorted(slot.alternatives[index].figures.items()) for slot, index in chosen]
    measured = [(name, expression.text) for name, expression in sorted(decision.measured().items())]
    content = repr((option_of(decision.slots, selections).key, figures, decision.utility.text, measured))
    return hashlib.sha256(content.encode()).hexdigest()[:16]


@dataclass(slots=True)
class Meter:
    """Averages the samples that are taken of a choice's utility, from the time on at which it shows its effect.

    ``meaning`` is that of the choice in its decision, which may become another one. ``unknown`` is why the latest
    sample that was to be taken does not count.
    """

    decision: str
    selections: tuple[int, ...]
    meaning: str
    ticket: str
    since: float
    unknown: str = ""
    first: float = 0.0
    last: float = 0.0
    total: float = 0.0
    count: int = 0

    def sample(self, now: float, decision: Decision, situation: Mapping[str, Any]) -> None:
        """Take a sample, unless it is too early or the utility is not known."""
        if now < self.since:
            return
        try:
            utility = measured_utility(decision, self.selections, situation)
        except Unknown as error:
            self.unknown = str(error)
            return
        if self.count == 0:
            self.first = now
        self.last = now
        self.total += utility
        self.count += 1

    def credit(self) -> dict[str, PlainValue] | None:
        """Return what the choice has earned, as a planner takes it; None if nothing was measured."""
        if self.count == 0:
            return None
        return {"ticket": self.ticket, "utility": self.total / self.count, "from": self.first, "to": self.last}

    def fits(self, decision: Decision) -> bool:
        """Return whether the choice still means the same in its decision."""
        slots = decision.slots
        is_there = len(self.selections) == len(slots) and all(
            selection < len(slot.selections) for slot, selection in zip(slots, self.selections, strict=True)
        )
        return is_there and meaning_of(decision, self.selections) == self.meaning
