"""Depth-first branch and bound, with bounds that know what goes together (Kask and Dechter, AIJ 129, 2001)."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.choices.problem import Problem
from regraft.adaptation_manager.planners.choices.rules.allowed_combinations import Search, TooHard
from regraft.adaptation_manager.planners.choices.solvers.compiled import Compiled, compiled
from regraft.adaptation_manager.planners.choices.solvers.protocol import TOLERANCE, UNLIMITED, Effort, Found, Solution

CLOCK_EVERY: Final = 256
"""Nodes between two looks at the clock."""


class BranchAndBound:
    """Chooses for one slot after the other, the most promising selection first.

    A branch is left when not even the bound of what follows is better than the best that was found.
    """

    name = "branch_and_bound"

    def solve(self, problem: Problem, most: int = 1, effort: Effort = UNLIMITED) -> Solution:
        """Return the best ``most`` combinations; the optimum is met within the tolerance."""
        began = time.process_time()
        try:
            domains = Search(problem.sizes, range(len(problem.sizes)), problem.rules).reduced()
        except TooHard:
            domains = [(1 << size) - 1 for size in problem.sizes]
        if domains is None:
            return Solution(self.name, (), -math.inf, True, 0, time.process_time() - began)
        walk = _Walk(problem, compiled(problem, domains), most, effort)
        walk.go()
        found = tuple(sorted(walk.best, key=lambda found: -found.worth))
        worth = found[0].worth if found else -math.inf
        proven = walk.left_open <= max(worth, walk.threshold)
        bound = worth if proven else walk.left_open
        return Solution(self.name, found, bound, proven, walk.nodes, time.process_time() - began)


@dataclass(slots=True)
class _Node:
    """A partial combination: how much its completions can be worth, and how much room the limits leave for them."""

    bound: float
    room: list[float]


class _Walk:
    """One search. ``left_open`` is the bound of what was not looked at, if it was given up."""

    def __init__(self, problem: Problem, parts: Compiled, most: int, effort: Effort) -> None:
        self.nodes = 0
        self.best: list[Found] = []
        self.threshold = -math.inf
        self.left_open = -math.inf
        self._problem = problem
        self._parts = parts
        self._most = most
        self._steps = math.inf if effort.steps is None else effort.steps
        self._until = math.inf if effort.deadline is None else time.monotonic() + effort.deadline
        self._chosen = [0] * len(problem.sizes)
        self._is_over = False

    def go(self) -> None:
        """Search all of it, or until the effort is spent."""
        root = _Node(self._parts.worth.root, list(self._parts.room))
        if root.bound > -math.inf:
            self._below(0, root)

    def _below(self, place: int, node: _Node) -> None:
        if place == len(self._chosen):
            self._take()
            return
        self.nodes += 1
        if self._gives_up():
            self.left_open = max(self.left_open, node.bound)
            return
        for bound, selection, room in self._children(place, node):
            if bound <= self.threshold:
                return
            if self._is_over:
                self.left_open = max(self.left_open, bound)
                return
            self._chosen[place] = selection
            self._below(place + 1, _Node(bound, room))

    def _children(self, place: int, node: _Node) -> list[tuple[float, int, list[float]]]:
        """Return the selections that may lead to something better, the most promising first."""
        chosen, level = self._chosen, self._parts.levels[place]
        bounds = [node.bound] * level.size
        for loss in level.worth:
            bounds = [bound + lost for bound, lost in zip(bounds, loss.row(chosen), strict=True)]
        open_ones = [selection for selection, bound in enumerate(bounds) if bound > self.threshold]
        for check in level.checks:
            open_ones = [selection for selection in open_ones if check(chosen, selection)]
        rooms: dict[int, list[float]] = {selection: [] for selection in open_ones}
        for index, losses in enumerate(level.limits):
            rows = [loss.row(chosen) for loss in losses]
            for selection in list(rooms):
                room = node.room[index] + sum(row[selection] for row in rows)
                if room < 0.0:
                    del rooms[selection]
                else:
                    rooms[selection].append(room)
        return sorted(((bounds[s], s, room) for s, room in rooms.items()), key=lambda child: (-child[0], child[1]))

    def _take(self) -> None:
        chosen = self._parts.original(self._chosen)
        worth = self._problem.worth(chosen)
        if worth == -math.inf or not self._problem.keeps(chosen):
            return
        self.best.append(Found(worth, chosen))
        if len(self.best) > self._most:
            self.best.remove(min(self.best, key=lambda found: found.worth))
        if len(self.best) == self._most:
            least = min(found.worth for found in self.best)
            self.threshold = least + TOLERANCE * max(1.0, abs(least))

    def _gives_up(self) -> bool:
        if self.nodes > self._steps or (self.nodes % CLOCK_EVERY == 0 and time.monotonic() > self._until):
            self._is_over = True
        return self._is_over
