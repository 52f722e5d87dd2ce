"""Puts a decision to the solvers: its rules and its objective in an architecture, under what is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from regraft.adaptation_manager.planners.choices.choosing import Choice, choose, choose_by_rules
from regraft.adaptation_manager.planners.choices.estimates import Estimator
from regraft.adaptation_manager.planners.choices.explanation import exclusions
from regraft.adaptation_manager.planners.choices.objective import Evaluation, Objective, finite
from regraft.adaptation_manager.planners.choices.problem import Problem
from regraft.adaptation_manager.planners.choices.rules.rulebook import Rulebook
from regraft.adaptation_manager.planners.choices.rules.rules import Clause
from regraft.adaptation_manager.planners.choices.solvers.protocol import UNLIMITED, Effort, Solver
from regraft.adaptation_manager.planners.decisions.model import Decision, Fault
from regraft.adaptation_manager.planners.decisions.standing import NOTHING_MEASURED, Standing
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Expression, Unknown

NOTHING: Final = Clause(0, ((0, 0),))
"""A rule that nothing keeps."""


@dataclass(slots=True)
class Question:
    """A decision in one situation.

    ``standing`` is what is measured of the present choice. ``faults`` are those that hold. ``prescribed`` are the
    alternatives that they prescribe, by slot. ``notes`` name what was not known.
    """

    decision: Decision
    evaluation: Evaluation
    rulebook: Rulebook
    standing: Standing = NOTHING_MEASURED
    faults: tuple[str, ...] = ()
    prescribed: dict[int, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def prescribes(self, selections: Sequence[int]) -> bool:
        """Return whether the faults prescribe a combination; without a prescription, none is."""
        return bool(self.prescribed) and all(
            self._prescribed_selections(slot) >> selections[slot] & 1 for slot in self.prescribed
        )

    def choose(self, architecture: Architecture, solver: Solver, effort: Effort = UNLIMITED) -> Choice:
        """Return the best of what faults prescribe, if that is possible, else of all; raises as `choosing.choose`.

        The utility of a prescribed combination need not be known.
        """
        if self.prescribed:
            narrowed = self._narrowed()
            found = self._chosen(narrowed, architecture, solver, effort)
            if found.option is not None:
                return found
            unvalued = choose_by_rules(
                self.evaluation, narrowed, architecture, solver, effort=effort, predicted=self._predicted()
            )
            if unvalued.option is not None:
                why = found.explanation.nothing
                self.notes.append(f"what is prescribed is chosen without a utility, most of the rest stays: {why}")
                return unvalued
            self.notes.append(f"the prescribed solution is not possible: {unvalued.explanation.nothing}")
        return self._chosen(self.rulebook, architecture, solver, effort)

    def _narrowed(self) -> Rulebook:
        rulebook = Rulebook(list(self.rulebook.rules), list(self.rulebook.texts))
        for slot in self.prescribed:
            rulebook.allow("what faults prescribe", slot, self._prescribed_selections(slot))
        return rulebook

    def _prescribed_selections(self, slot: int) -> int:
        return self.decision.slots[slot].within_alternatives(self.prescribed[slot])

    def excluded(self) -> list[dict[str, Any]]:
        """Return the alternatives that no combination can have, as plain data."""
        slots = self.decision.slots
        problem = Problem(tuple(len(slot.selections) for slot in slots), tuple(self.rulebook.rules))
        return [asdict(each) for each in exclusions(slots, problem, self.rulebook.texts)]

    def _chosen(self, rulebook: Rulebook, architecture: Architecture, solver: Solver, effort: Effort) -> Choice:
        return choose(
            self.evaluation,
            rulebook,
            architecture,
            solver,
            margin=self.decision.margin,
            effort=effort,
            predicted=self._predicted(),
        )

    def _predicted(self) -> dict[str, Expression]:
        decision = self.decision
        return {name: Expression(name) for name in decision.estimated() if name not in decision.weights}


def question_of(
    decision: Decision, context: Mapping[str, Any], estimator: Estimator, standing: Standing = NOTHING_MEASURED
) -> Question:
    """Return what a decision asks under a context, where so much is measured of what stands.

    Raises:
        BadMessage: a constraint ties too much together.
    """
    evaluation, standing = _evaluation(decision, context, estimator, standing)
    rulebook = Rulebook()
    for text, rules in decision.rules:
        rulebook.add(text, rules)
    rulebook.exclude_contradictions(decision.slots)
    question = Question(decision, evaluation, rulebook, standing, notes=list(standing.notes))
    known = Known(context, decision.weights)
    question.faults = tuple(fault.name for fault in decision.faults if _holds(fault, known, question))
    for limit in decision.limits:
        try:
            rulebook.limit(limit.text, decision.slots, limit.figure, limit.most.number(known))
        except Unknown as error:
            rulebook.add(f"{limit.text}, of which {error},", [NOTHING])
    for requirement in decision.requirements:
        rulebook.require(requirement.text, *evaluation.truths(requirement.expression))
    question.notes += evaluation.unknown
    return question


def _evaluation(
    decision: Decision, context: Mapping[str, Any], estimator: Estimator, standing: Standing
) -> tuple[Evaluation, Standing]:
    """Return the objective under a context; what is measured is left out if it ties too much together."""
    objective = Objective(decision.utility, decision.assume, decision.estimated())
    if standing.values:
        try:
            evaluation = Evaluation(decision.slots, objective, context, estimator, standing.values)
            evaluation.check_measured()
            return evaluation, standing
        except BadMessage as error:
            standing = standing.without_values(str(error))
    return Evaluation(decision.slots, objective, context, estimator), standing


def _holds(fault: Fault, known: Mapping[str, Any], question: Question) -> bool:
    try:
        if not fault.when.value(known):
            return False
    except Unknown as error:
        question.notes.append(f"fault {fault.name} counts as absent: {error}")
        return False
    slots = question.decision.slots
    for slot, mask in fault.excludes:
        question.rulebook.exclude(f"fault {fault.name}", slots, slot, mask)
    for slot, mask in fault.prescribes:
        question.prescribed[slot] = question.prescribed.get(slot, mask) & mask
    return True


class Known(dict[str, Any]):
    """Known values by name: the context, and expressions over it. Numbers that are none, or infinite, are unknown."""

    def __init__(self, context: Mapping[str, Any], named: Mapping[str, Expression]) -> None:
        super().__init__()
        self._context = context
        self._named = named
        self._within: list[str] = []

    def __missing__(self, name: str) -> Any:
        """Look a value up; raises KeyError or Unknown."""
        if name in self._named and name not in self._within:
            self._within.append(name)
            try:
                return self._named[name].value(self)
            finally:
                self._within.remove(name)
        return finite(self._context[name], name)
