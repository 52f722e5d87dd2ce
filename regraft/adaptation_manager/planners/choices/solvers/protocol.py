"""The interface of all solvers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Protocol

from regraft.adaptation_manager.planners.choices.problem import Problem

TOLERANCE = 1e-9
"""The share of an objective by which a proven optimum may miss the true one: floats add up inexactly."""


class CannotSolve(Exception):
    """The solver cannot take the problem on; the text states why, and names a solver that can."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How long a solver may search: ``steps`` are repeatable, ``deadline`` (s of the wall clock) is not.

    None means without end.
    """

    steps: int | None = None
    deadline: float | None = None


UNLIMITED: Final = Effort()


@dataclass(frozen=True, slots=True)
class Found:
    """A combination that keeps all rules, and its objective."""

    worth: float
    chosen: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Solution:
    """The result of a solver: the best combinations, best first, and that none is worth more than ``bound``.

    ``seconds`` are those of the processor, ``steps`` what the solver counts: combinations, nodes or branches.
    """

    solver: str
    found: tuple[Found, ...]
    bound: float
    proven: bool
    steps: int
    seconds: float

    @property
    def gap(self) -> float:
        """How much more than the best that was found there may be at the most; infinite if nothing was found."""
        if self.proven:
            return 0.0
        return max(0.0, self.bound - self.found[0].worth) if self.found else math.inf


class Solver(Protocol):
    """Finds the combinations with the greatest objective."""

    name: str

    def solve(self, problem: Problem, most: int = 1, effort: Effort = UNLIMITED) -> Solution:
        """Return the best ``most`` combinations; raises CannotSolve."""
        ...
