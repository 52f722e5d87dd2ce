"""Which frontiers were given, and which of them there is no use in giving again."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from regraft.planar import Point, Pose2D
from regraft.services.explorer.frontiers import Frontier
from regraft.services.explorer.ground import Ground

SAME_TARGET = 0.30
"""Frontiers whose targets (m) are closer than this are the same."""
AROUND = 0.5
"""Half the side (m) of the square in which the map must have changed."""
MAX_TIMES = 3
"""How often a frontier is given while no more ground becomes known around it."""

MAX_REPEATS = 10
"""How often a frontier is given once more to a robot that has not gone there."""


@dataclass(frozen=True, slots=True)
class Place:
    """A frontier that was given: its target and the goals to look at it (m), and how the map was around it then.

    `known` and `occupied` count cells. The goals of a `seen` one show nothing more; a `closed` one is not given again.
    Both end when the map around it changes. `repeats` counts how often it was given again before the robot went there,
    as when it had to charge first.
    """

    target: Point
    goals: tuple[Point, ...]
    known: int
    occupied: int
    seen: bool = False
    closed: bool = False
    repeats: int = 0

    @property
    def times(self) -> int:
        """How often it was given without effect."""
        return len(self.goals)


class Places:
    """Remembers what was given, so that exploring ends even where a frontier can never be looked behind.

    A frontier that stays is looked at from other places, `MAX_TIMES` in all. One that was not reached is closed at
    once. It is opened again when more ground has become known around it, which has an end. It is also opened when
    obstacles have changed there, `MAX_TIMES` at the most.
    """

    def __init__(self, renewal: float) -> None:
        """Begin with nothing given; `renewal` (m²) is how much ground must have changed around a place."""
        self.renewal = renewal
        self._places: list[Place] = []
        self.last: Frontier | None = None

    def give(self, frontier: Frontier, ground: Ground) -> None:
        """Note that a frontier is given now; given again before the robot went there, it counts less."""
        at, goal = self._index(frontier), frontier.goal.position
        known, occupied = _around(ground, frontier.target)
        place = Place(frontier.target, (goal,), known, occupied)
        if at is not None and not self._grown(self._places[at], known, ground):
            before = self._places[at]
            again = self.last is not None and self._index(self.last) == at
            repeats = before.repeats + again
            goals = (*(before.goals[:-1] if again else before.goals), goal)
            closed = len(goals) >= MAX_TIMES or repeats >= MAX_REPEATS
            place = replace(place, goals=goals, seen=before.seen, closed=closed, repeats=repeats)
        self._put(at, place)
        self.last = frontier

    def spend(self, ground: Ground, *, unreached: bool = False) -> None:
        """Note that the last place need not be visited again while the map is as now."""
        at = None if self.last is None else self._index(self.last)
        if at is None:
            return
        place = self._places[at]
        known, occupied = _around(ground, place.target)
        goals = place.goals[-1:] if self._grown(place, known, ground) else place.goals
        closed = unreached or len(goals) >= MAX_TIMES
        self._put(at, replace(place, goals=goals, known=known, occupied=occupied, seen=True, closed=closed))
        self.last = None

    def still_there(self, frontiers: list[Frontier]) -> bool:
        """Return whether the last one is still among some frontiers."""
        last = self.last
        return last is not None and any(math.dist(last.target, each.target) < SAME_TARGET for each in frontiers)

    def open(self, frontier: Frontier, ground: Ground) -> bool:
        """Return whether a frontier may be given."""
        closed = [place for place in self._unchanged(ground) if place.closed]
        return not any(math.dist(place.target, frontier.target) < SAME_TARGET for place in closed)

    def useless(self, ground: Ground) -> list[Point]:
        """Return the goals (m) that were not reached, or from where nothing more was seen."""
        return [goal for place in self._unchanged(ground) if place.seen for goal in place.goals]

    def _unchanged(self, ground: Ground) -> list[Place]:
        return [place for place in self._places if not self._changed(place, ground)]

    def snapshot(self) -> dict[str, Any]:
        """Return the places, and the frontier given last, as plain data."""
        last = self.last
        return {
            "places": [
                [*p.target, [list(goal) for goal in p.goals], p.known, p.occupied, p.seen, p.closed, p.repeats]
                for p in self._places
            ],
            "last": last and [*last.target, last.goal.x, last.goal.y, last.goal.yaw, last.length, last.distance],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the places of a snapshot."""
        self._places = [
            Place((tx, ty), tuple((x, y) for x, y in goals), known, occupied, seen, closed, repeats)
            for tx, ty, goals, known, occupied, seen, closed, repeats in state["places"]
        ]
        self.last = None
        if state["last"] is not None:
            tx, ty, x, y, yaw, length, distance = state["last"]
            self.last = Frontier((tx, ty), Pose2D(x, y, yaw), length, distance)

    def _index(self, frontier: Frontier) -> int | None:
        near = [i for i, place in enumerate(self._places) if math.dist(place.target, frontier.target) < SAME_TARGET]
        return min(near, key=lambda i: math.dist(self._places[i].target, frontier.target), default=None)

    def _put(self, at: int | None, place: Place) -> None:
        if at is None:
            self._places.append(place)
        else:
            self._places[at] = place

    def _grown(self, place: Place, known: int, ground: Ground) -> bool:
        return known - place.known >= self._cells(ground)

    def _changed(self, place: Place, ground: Ground) -> bool:
        known, occupied = _around(ground, place.target)
        if self._grown(place, known, ground):
            return True
        changed = max(abs(known - place.known), abs(occupied - place.occupied))
        return place.times < MAX_TIMES and changed >= self._cells(ground)

    def _cells(self, ground: Ground) -> float:
        return self.renewal / ground.grid.resolution**2


def _around(ground: Ground, point: Point) -> tuple[int, int]:
    """Return how many cells around a point are known, and how many of them are occupied."""
    grid = ground.grid
    row, column = grid.cell_of(point)
    reach = math.ceil(AROUND / grid.resolution)
    rows, columns = (
        slice(max(row - reach, 0), row + reach + 1),
        slice(max(column - reach, 0), column + reach + 1),
    )
    known = np.count_nonzero(grid.cells[rows, columns] >= 0)
    return int(known), int(np.count_nonzero(grid.occupied[rows, columns]))
