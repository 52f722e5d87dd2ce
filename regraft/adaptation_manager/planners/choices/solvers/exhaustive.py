"""Looks at every combination: the oracle that other solvers are compared with."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from itertools import product
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from regraft.adaptation_manager.planners.choices.problem import Problem
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Rule
from regraft.adaptation_manager.planners.choices.solvers.protocol import UNLIMITED, CannotSolve, Effort, Found, Solution

MAX_COMBINATIONS: Final = 50_000_000
AT_ONCE: Final = 500_000
"""Combinations that are held in memory."""


class Exhaustive:
    """Evaluates all combinations, in blocks of those that share the selections of the first slots."""

    name = "exhaustive"

    def solve(self, problem: Problem, most: int = 1, effort: Effort = UNLIMITED) -> Solution:
        """Return the best ``most`` combinations, of equal ones the first; raises CannotSolve."""
        if problem.combinations > MAX_COMBINATIONS:
            what = f"there are {problem.combinations} combinations, exhaustive search takes at most {MAX_COMBINATIONS}"
            raise CannotSolve(f"{what}: take branch_and_bound or cp_sat")
        began, clock = time.process_time(), time.monotonic()
        blocks = _Blocks(problem)
        best: list[Found] = []
        seen = 0
        for lead in blocks.leads():
            if _is_over(effort, seen, clock):
                break
            best = sorted([*best, *blocks.best(lead, most)], key=lambda found: -found.worth)[:most]
            seen += blocks.size
        proven = seen >= problem.combinations
        bound = (best[0].worth if best else -math.inf) if proven else math.inf
        return Solution(self.name, tuple(best), bound, proven, seen, time.process_time() - began)


def _is_over(effort: Effort, seen: int, began: float) -> bool:
    late = effort.deadline is not None and time.monotonic() - began > effort.deadline
    return late or (effort.steps is not None and seen >= effort.steps)


class _Blocks:
    """A problem whose first slots are fixed, one way after the other; the others are axes of an array."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        sizes = problem.sizes
        self._fixed = next(k for k in range(len(sizes) + 1) if math.prod(sizes[k:]) <= AT_ONCE)
        self._shape = sizes[self._fixed :]
        self.size = math.prod(self._shape)

    def leads(self) -> Any:
        """Return all selections of the fixed slots."""
        return product(*(range(size) for size in self._problem.sizes[: self._fixed]))

    def best(self, lead: tuple[int, ...], most: int) -> list[Found]:
        """Return the best combinations under a lead, best first."""
        worth = np.zeros(self._shape)
        for term in self._problem.terms:
            worth = worth + self._spread(term.slots, term.worth, lead)
        for rule in self._problem.rules:
            worth = np.where(self._kept(rule, lead), worth, -math.inf)
        flat = worth.reshape(-1)
        order = np.argsort(-flat, kind="stable")[:most] if most > 1 else [int(np.argmax(flat))]
        chosen = [(float(flat[at]), np.unravel_index(int(at), self._shape)) for at in order]
        return [Found(value, (*lead, *map(int, rest))) for value, rest in chosen if value > -math.inf]

    def _kept(self, rule: Rule, lead: tuple[int, ...]) -> NDArray[np.bool_]:
        sizes = self._problem.sizes
        if isinstance(rule, Limit):
            zero: NDArray[np.float64] = np.zeros(())
            total = sum((self._spread((slot,), np.array(uses), lead) for slot, uses in rule.uses), zero)
            return np.asarray(total <= rule.bound)
        if isinstance(rule, Clause):
            kept: NDArray[np.bool_] = np.zeros((), dtype=bool)
            for slot, mask in rule.ways:
                allowed = np.array([bool(mask >> index & 1) for index in range(sizes[slot])])
                kept = kept | self._spread((slot,), allowed, lead)
            return kept
        return self._spread(rule.scope(), rule.table(sizes), lead)

    def _spread(self, scope: Sequence[int], table: NDArray[Any], lead: tuple[int, ...]) -> NDArray[Any]:
        """Return a table over some slots so that it can be added to others over other slots."""
        order = sorted(range(len(scope)), key=lambda axis: scope[axis])
        ordered = table.transpose(order)
        index = tuple(lead[scope[axis]] if scope[axis] < self._fixed else slice(None) for axis in order)
        shape = [1] * len(self._shape)
        for axis in order:
            if scope[axis] >= self._fixed:
                shape[scope[axis] - self._fixed] = table.shape[axis]
        return np.asarray(ordered[index]).reshape(shape)
