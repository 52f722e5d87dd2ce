"""A robot that goes where the explorer sends it, and maps what it sees."""

import math

import numpy as np

from regraft.bus_schema.messages.maps import Frontier, NextFrontier
from regraft.services.explorer.explorer import Explorer
from regraft.testing import Rig

from .rooms import Mapped, Room, odometry


class Tour:
    """An explorer on a rig, and a robot in a room that jumps to reachable goals or drives to them."""

    def __init__(
        self, rig: Rig, room: Room, start: tuple[float, float], noise: float = 0.0, **parameters: object
    ) -> None:
        self.rig, self.room, self.mapped = rig, room, Mapped(room, noise)
        self.explorer = rig.add(Explorer, parameters=parameters)
        self.distance = 0.0
        self.answers: list[Frontier] = []
        self._stand(*start)

    def ask(self, unreached: bool = False) -> Frontier:
        """Ask for the next frontier with a map of just now."""
        now = self.rig.clock.now() / 1e9
        self.rig.publish("map", self.mapped.message(now))
        self.rig.publish("odometry", odometry(now, *self.place))
        self.answers.append(self.rig.call("next_frontier", NextFrontier(unreached), Frontier))
        return self.answers[-1]

    def go(self, goal: Frontier, *, look_on_the_way: bool = False) -> bool:
        """Go to a goal, or as near to it as the room has a way, and look round there; tell whether it was reached."""
        assert goal.goal is not None
        there = (goal.goal.pose.x, goal.goal.pose.y)
        truth = self.room.ground(self.place)
        last = truth.grid.cell_of(there)
        lengths = truth.ways(np.array([last]))[0] if truth.allowed[last] else np.full(truth.allowed.shape, math.inf)
        cell = truth.start
        if not math.isfinite(lengths[cell]):
            near = np.argwhere(truth.reachable)
            row, column = near[np.hypot(*(near - last).T).argmin()]
            self._stand(*truth.point((int(row), int(column))))
            return False
        self.distance += float(lengths[cell])
        while look_on_the_way and cell != last:
            around = [(cell[0] + i, cell[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
            cell = min(around, key=lambda each: (lengths[each], each))
            if sum(cell) % 2 == 0:
                self.mapped.reveal(*truth.point(cell))
        self._stand(*there)
        return True

    def explore(self, most: int = 60, *, look_on_the_way: bool = False) -> None:
        """Go where the explorer says until nothing is left; fails after too many requests."""
        reached = True
        for _ in range(most):
            answer = self.ask(unreached=not reached)
            if not answer.found:
                return
            reached = self.go(answer, look_on_the_way=look_on_the_way)
        raise AssertionError(f"no end after {most} frontiers")

    def unseen(self) -> float:
        """Return how much (m²) of the ground that the robot can get to is not known."""
        truth = self.room.ground(self.place)
        return float(np.count_nonzero(truth.reachable & (self.mapped.cells < 0))) * truth.grid.resolution**2

    def _stand(self, x: float, y: float) -> None:
        self.place = (x, y)
        self.mapped.reveal(x, y)
