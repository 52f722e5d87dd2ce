"""The worth of a choice: the mean of the measured utility while it was in force."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from regraft.adaptation_manager.planners.choices.estimates import NoEstimates
from regraft.adaptation_manager.planners.choices.objective import Evaluation, Objective
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.expressions import Unknown

SAMPLE_EVERY: Final = 0.25
"""Seconds."""


def measured_utility(decision: Decision, selections: Sequence[int], situation: Mapping[str, Any]) -> float | None:
    """Return the utility of a choice by what is measured, None where that is not known."""
    objective = Objective(decision.utility, named=decision.measured())
    evaluation = Evaluation(decision.slots, objective, situation, NoEstimates())
    try:
        return evaluation.value(decision.utility, selections)
    except Unknown:
        return None


@dataclass(slots=True)
class Meter:
    """Averages the samples that are taken of a choice's utility, from the time on at which it shows its effect."""

    decision: Decision
    selections: tuple[int, ...]
    ticket: str
    since: float
    _first: float = math.nan
    _last: float = math.nan
    _sum: float = 0.0
    _count: int = 0

    def sample(self, now: float, situation: Mapping[str, Any]) -> None:
        """Take a sample, unless it is too early or the utility is not known."""
        if now < self.since:
            return
        utility = measured_utility(self.decision, self.selections, situation)
        if utility is None:
            return
        if self._count == 0:
            self._first = now
        self._last = now
        self._sum += utility
        self._count += 1

    def credit(self) -> dict[str, PlainValue] | None:
        """Return what the choice has earned, as a planner takes it; None if nothing was measured."""
        if self._count == 0:
            return None
        return {"ticket": self.ticket, "utility": self._sum / self._count, "from": self._first, "to": self._last}
