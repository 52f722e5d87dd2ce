"""CP-SAT of Google's OR-tools: for spaces too tangled for branch and bound; an extra, ``regraft[cp-sat]``."""

from __future__ import annotations

import math
import time
from itertools import product
from typing import Any, Final

import numpy as np

from regraft.adaptation_manager.planners.choices.problem import UNKNOWN, Problem
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Relation, Rule, bits
from regraft.adaptation_manager.planners.choices.solvers.protocol import UNLIMITED, CannotSolve, Effort, Found, Solution

SCALE: Final = 2**40
"""The whole number that the greatest sum of objective or amounts becomes: CP-SAT adds up whole numbers only."""
LEAST: Final = 1e-290
"""The least sum that becomes so great: the scale of anything less would be infinite."""
SEED: Final = 1
STEPS_PER_SECOND: Final = 1_000_000
"""Steps of an effort that make one second of CP-SAT's deterministic time."""


class CpSat:
    """Has CP-SAT search, on one thread and repeatably unless a deadline ends it."""

    name = "cp_sat"

    def solve(self, problem: Problem, most: int = 1, effort: Effort = UNLIMITED) -> Solution:
        """Return the best ``most`` combinations, one after the other; raises CannotSolve."""
        cp_model = _imported()
        began, clock = time.process_time(), time.monotonic()
        if any(not term.slots and float(term.worth) == UNKNOWN for term in problem.terms):
            return Solution(self.name, (), -math.inf, True, 0, time.process_time() - began)
        model = _Model(cp_model, problem)
        found: list[Found] = []
        bound, proven, steps = math.inf, True, 0
        for number in range(most):
            solver = cp_model.CpSolver()
            _limit(solver.parameters, effort, clock)
            status = solver.solve(model.model)
            steps += solver.num_branches
            ended = status in (cp_model.OPTIMAL, cp_model.INFEASIBLE)
            proven = proven and ended
            if number == 0:
                bound = model.unscaled(solver.best_objective_bound) if status != cp_model.INFEASIBLE else -math.inf
            if status not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
                break
            chosen = model.chosen(solver)
            found.append(Found(problem.worth(chosen), chosen))
            model.forbid(chosen)
        found.sort(key=lambda each: -each.worth)
        if proven and found:
            bound = found[0].worth
        return Solution(self.name, tuple(found), bound, proven, steps, time.process_time() - began)


def _imported() -> Any:
    try:
        from ortools.sat.python import cp_model
    except ImportError as error:
        why = f"cp_sat needs OR-tools, which cannot be imported ({error}): pip install 'regraft[cp-sat]'"
        raise CannotSolve(f"{why}; or take branch_and_bound") from None
    return cp_model


def _limit(parameters: Any, effort: Effort, began: float) -> None:
    parameters.num_workers = 1
    parameters.random_seed = SEED
    if effort.deadline is not None:
        parameters.max_time_in_seconds = max(0.001, effort.deadline - (time.monotonic() - began))
    if effort.steps is not None:
        parameters.max_deterministic_time = effort.steps / STEPS_PER_SECOND


class _Model:
    """A problem in CP-SAT's terms: a truth value for each selection, of which one per slot is true."""

    def __init__(self, cp_model: Any, problem: Problem) -> None:
        self.model = cp_model.CpModel()
        self._is = [
            [self.model.new_bool_var(f"{slot}/{index}") for index in range(size)]
            for slot, size in enumerate(problem.sizes)
        ]
        for values in self._is:
            self.model.add_exactly_one(values)
        for rule in problem.rules:
            self._keep(rule, problem)
        self._maximise(problem)

    def chosen(self, solver: Any) -> tuple[int, ...]:
        """Return the combination that was found."""
        return tuple(next(i for i, value in enumerate(values) if solver.boolean_value(value)) for values in self._is)

    def forbid(self, chosen: tuple[int, ...]) -> None:
        """Leave a combination out from now on."""
        self.model.add_bool_or([~self._is[slot][index] for slot, index in enumerate(chosen)])

    def unscaled(self, objective: float) -> float:
        """Return an objective of CP-SAT's as the problem's own, rounded up by what rounding may have taken."""
        return (objective + self._rounded) / self._scale + self._constant

    def _keep(self, rule: Rule, problem: Problem) -> None:
        if isinstance(rule, Limit):
            self._keep_limit(rule)
        elif isinstance(rule, Clause):
            self.model.add_bool_or([self._is[slot][index] for slot, mask in rule.ways for index in bits(mask)])
        elif isinstance(rule, Relation):
            for index, mask in enumerate(rule.partners_of_left):
                partners = [each for other, each in enumerate(self._is[rule.right]) if mask >> other & 1]
                self.model.add_bool_or([~self._is[rule.left][index], *partners])
        else:
            for combination in np.argwhere(~rule.kept):
                parts = zip(rule.slots, combination.tolist(), strict=True)
                self.model.add_bool_or([~self._is[slot][index] for slot, index in parts])

    def _keep_limit(self, rule: Limit) -> None:
        greatest = sum(max(map(abs, amounts)) for _, amounts in rule.uses)
        scale = SCALE / max(greatest, abs(rule.bound), LEAST)
        uses = [
            (self._is[slot][index], math.floor(amount * scale))
            for slot, amounts in rule.uses
            for index, amount in enumerate(amounts)
        ]
        self.model.add(sum(value * amount for value, amount in uses) <= math.floor(rule.bound * scale))

    def _maximise(self, problem: Problem) -> None:
        known = [term for term in problem.terms if term.slots]
        self._constant = sum((float(term.worth) for term in problem.terms if not term.slots), 0.0)
        sums = [np.abs(term.worth[np.isfinite(term.worth)]).max(initial=0.0) for term in known]
        self._scale = SCALE / max(float(sum(sums)), LEAST)
        self._rounded = float(len(known))
        self.model.maximize(sum((self._worth(term.slots, term.worth) for term in known), 0))

    def _worth(self, slots: tuple[int, ...], worth: Any) -> Any:
        """Return a term's worth as a sum; a term of several slots has a truth value for each combination."""
        parts = []
        for combination in product(*(range(size) for size in worth.shape)):
            is_it = self._is_all(slots, combination)
            value = float(worth[combination])
            if value == -math.inf:
                self.model.add(is_it == 0)
            else:
                parts.append((is_it, math.floor(value * self._scale)))
        if len(slots) > 1:
            self.model.add_exactly_one([is_it for is_it, _ in parts])
        return sum(is_it * value for is_it, value in parts)

    def _is_all(self, slots: tuple[int, ...], combination: tuple[int, ...]) -> Any:
        each = [self._is[slot][index] for slot, index in zip(slots, combination, strict=True)]
        if len(each) == 1:
            return each[0]
        both = self.model.new_bool_var("")
        for one in each:
            self.model.add_implication(both, one)
        return both
