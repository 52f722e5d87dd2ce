"""Choosing what should be: the best combination of alternatives, what it changes, and why it was chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from regraft.adaptation_manager.planners.choices.explanation import (
    ESTIMATED,
    MEASURED,
    UNKNOWN_SOURCE,
    Explanation,
    Prediction,
    RunnerUp,
    exclusions,
)
from regraft.adaptation_manager.planners.choices.in_architecture import all_stand, changes_for
from regraft.adaptation_manager.planners.choices.objective import Evaluation
from regraft.adaptation_manager.planners.choices.problem import UNKNOWN, Problem, Term
from regraft.adaptation_manager.planners.choices.rules.infeasible import impossible
from regraft.adaptation_manager.planners.choices.rules.rulebook import Rulebook
from regraft.adaptation_manager.planners.choices.slots import Option, Slot, option_of
from regraft.adaptation_manager.planners.choices.solvers.protocol import UNLIMITED, Effort, Found, Solution, Solver
from regraft.bus_schema.model.adaptation import Change
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Expression, Unknown

RUNNERS_UP: Final = 3


@dataclass(frozen=True, slots=True)
class Choice:
    """The result of choosing: the option, its utility, the changes that lead to it, and why; None if there is none.

    An option without a utility was chosen by the rules alone.
    """

    option: Option | None
    utility: float | None
    changes: tuple[Change, ...]
    explanation: Explanation


def standing(slots: Sequence[Slot], architecture: Architecture) -> tuple[int, ...] | None:
    """Return the selection of each slot that is in force, None if one has none.

    Where several are in force, it is the one with the most settings.
    """
    found = standing_selections(slots, architecture)
    known = tuple(selection for selection in found if selection is not None)
    return known if len(known) == len(found) else None


def standing_selections(slots: Sequence[Slot], architecture: Architecture) -> tuple[int | None, ...]:
    """Return the selection of each slot that is in force, None for a slot of which none is."""
    return tuple(_in_force(slot, architecture) for slot in slots)


def _in_force(slot: Slot, architecture: Architecture) -> int | None:
    found = [i for i in range(len(slot.selections)) if all_stand(slot.settings(i), architecture)]
    return max(found, key=lambda index: (len(slot.settings(index)), -index)) if found else None


def choose(
    evaluation: Evaluation,
    rulebook: Rulebook,
    architecture: Architecture,
    solver: Solver,
    *,
    margin: float = 0.0,
    effort: Effort = UNLIMITED,
    predicted: Mapping[str, Expression] | None = None,
) -> Choice:
    """Return the best combination that keeps all rules: the present one, unless another is better by the margin.

    ``predicted`` are the expressions whose values are part of the explanation.

    Raises:
        BadMessage: the objective or a rule ties too many alternatives together.
        CannotSolve: the solver cannot take the problem on.
    """
    slots = evaluation.slots
    sizes = tuple(len(slot.selections) for slot in slots)
    problem = Problem(sizes, tuple(rulebook.rules), evaluation.terms())
    solution = solver.solve(problem, 1 + RUNNERS_UP, effort)
    present = standing(slots, architecture)
    stands = None if present is None or not problem.keeps(present) else Found(problem.worth(present), present)
    chosen = _chosen(solution, stands, margin)
    context = _Explaining(evaluation, rulebook, problem, predicted or {})
    explanation = context.explain(solution, chosen, stands)
    if chosen is None:
        return Choice(None, None, (), explanation)
    option = option_of(slots, chosen.chosen)
    return Choice(option, chosen.worth, changes_for(option.settings, architecture), explanation)


def choose_by_rules(
    evaluation: Evaluation,
    rulebook: Rulebook,
    architecture: Architecture,
    solver: Solver,
    *,
    effort: Effort = UNLIMITED,
    predicted: Mapping[str, Expression] | None = None,
) -> Choice:
    """Return a combination by the rules alone, without its worth: one that leaves most slots as they are.

    Raises:
        CannotSolve: the solver cannot take the problem on.
    """
    slots = evaluation.slots
    present = standing_selections(slots, architecture)
    sizes = tuple(len(slot.selections) for slot in slots)
    terms = [
        Term((slot,), (np.arange(sizes[slot]) == selection).astype(np.float64))
        for slot, selection in enumerate(present)
        if selection is not None
    ]
    problem = Problem(sizes, tuple(rulebook.rules), tuple(terms))
    solution = solver.solve(problem, 1, effort)
    chosen = solution.found[0] if solution.found else None
    known = standing(slots, architecture)
    stands = None if known is None or not problem.keeps(known) else Found(UNKNOWN, known)
    context = _Explaining(evaluation, rulebook, problem, predicted or {}, by_rules=True)
    explanation = context.explain(solution, chosen, stands)
    if chosen is None:
        return Choice(None, None, (), explanation)
    option = option_of(slots, chosen.chosen)
    return Choice(option, None, changes_for(option.settings, architecture), explanation)


def _chosen(solution: Solution, stands: Found | None, margin: float) -> Found | None:
    best = solution.found[0] if solution.found else None
    if stands is not None and stands.worth > float("-inf") and (best is None or best.worth <= stands.worth + margin):
        return stands
    return best


@dataclass(frozen=True, slots=True)
class _Explaining:
    """The sources of an explanation."""

    evaluation: Evaluation
    rulebook: Rulebook
    problem: Problem
    predicted: Mapping[str, Expression]
    by_rules: bool = False

    def explain(self, solution: Solution, chosen: Found | None, stands: Found | None) -> Explanation:
        """Return the explanation of a choice."""
        slots = self.evaluation.slots
        others = [each for each in solution.found if chosen is None or each.chosen != chosen.chosen][:RUNNERS_UP]
        return Explanation(
            solver=solution.solver,
            combinations=self.problem.combinations,
            excluded=exclusions(slots, self.problem, self.rulebook.texts),
            runners_up=tuple(RunnerUp(option_of(slots, each.chosen).values, each.worth) for each in others),
            predicted=tuple(self._prediction(name, text, chosen, stands) for name, text in self.predicted.items()),
            standing=stands.worth if stands is not None and stands.worth > float("-inf") else None,
            unknown=tuple(self.evaluation.unknown),
            nothing=self._nothing(solution) if chosen is None else "",
            proven=solution.proven,
            gap=solution.gap,
            steps=solution.steps,
            seconds=solution.seconds,
        )

    def _prediction(self, name: str, text: Expression, chosen: Found | None, stands: Found | None) -> Prediction:
        before, after = self._value(text, stands), self._value(text, chosen)
        return Prediction(name, before, after, self._source(name, before, stands), self._source(name, after, chosen))

    def _source(self, name: str, value: Any, found: Found | None) -> str:
        if value is None or found is None:
            return UNKNOWN_SOURCE
        return MEASURED if self.evaluation.is_measured(name, dict(enumerate(found.chosen))) else ESTIMATED

    def _value(self, expression: Expression, found: Found | None) -> Any:
        if found is None:
            return None
        try:
            return self.evaluation.value(expression, found.chosen)
        except Unknown:
            return None

    def _nothing(self, solution: Solution) -> str:
        if not solution.proven:
            return f"{solution.solver} found nothing within its effort, after {solution.steps} steps"
        unknown = "; ".join(self.evaluation.unknown)
        members = range(len(self.problem.sizes))
        if unknown and not self.by_rules:
            return f"nothing can be expected: {unknown}"
        return impossible(self.problem.sizes, members, self.problem.rules, self.rulebook.texts)
