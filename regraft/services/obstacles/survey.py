"""From maps to the places worth visiting."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from regraft.planar import FloatArray, Point, Pose2D
from regraft.services.explorer.ground import Cells, Ground
from regraft.services.obstacles.names import Names
from regraft.services.obstacles.things import Thing, find_things
from regraft.services.obstacles.tour import short_tour
from regraft.services.obstacles.views import ViewSettings, find_view, still_good


@dataclass(frozen=True, slots=True)
class SurveySettings:
    """The definition of a thing (diagonal in m), and the way to look at one."""

    smallest: float = 0.12
    largest: float = 1.5
    views: ViewSettings = field(default_factory=ViewSettings)


@dataclass(frozen=True, slots=True)
class Viewed:
    """A thing with a name, its middle (m), and the pose from which to look at it; None if there is none."""

    name: str
    centre: Point
    pose: Pose2D | None

    @property
    def distance(self) -> float:
        """How far (m) the middle is from the pose; infinite without one."""
        return math.inf if self.pose is None else math.dist(self.centre, self.pose.position)


class Survey:
    """Looks at one map after the other; names and poses change no more than the map makes them."""

    def __init__(self) -> None:
        self._names = Names()
        self._poses: dict[str, Pose2D] = {}
        self._standoff: float | None = None
        """The liked distance (m) that the poses were found for."""
        self._ways: tuple[tuple[Pose2D, ...], FloatArray] = ((), np.zeros((0, 0)))

    def look(self, ground: Ground, settings: SurveySettings) -> list[Viewed]:
        """Return the things of a map in the order of a short tour from the robot; those without a pose come last."""
        if settings.views.standoff != self._standoff:
            self._poses.clear()
            self._standoff = settings.views.standoff
        things = find_things(ground, settings.smallest, settings.largest)
        names = self._names.name([thing.centre for thing in things])
        found = [
            Viewed(name, thing.centre, self._pose(ground, name, thing, settings.views))
            for name, thing in zip(names, things, strict=True)
        ]
        in_view = [each for each in found if each.pose is not None]
        order = self._order(ground, [each.pose for each in in_view if each.pose is not None])
        return [in_view[i] for i in order] + [each for each in found if each.pose is None]

    def snapshot(self) -> dict[str, Any]:
        """Return names and poses, and what distance these are for, as plain data."""
        poses = {name: [pose.x, pose.y, pose.yaw] for name, pose in self._poses.items()}
        return {"names": self._names.snapshot(), "poses": poses, "standoff": self._standoff}

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self._names.restore(state["names"])
        self._poses = {name: Pose2D(*parts) for name, parts in state["poses"].items()}
        self._standoff = state["standoff"]

    def _pose(self, ground: Ground, name: str, thing: Thing, settings: ViewSettings) -> Pose2D | None:
        before = self._poses.get(name)
        if before is not None and still_good(ground, thing, before, settings):
            return before
        pose = find_view(ground, thing, settings)
        if pose is not None:
            self._poses[name] = pose
        return pose

    def _order(self, ground: Ground, poses: list[Pose2D]) -> list[int]:
        if not poses:
            return []
        cells = np.array([ground.grid.cell_of(pose.position) for pose in poses], np.intp)
        if self._ways[0] != tuple(poses):
            self._ways = (tuple(poses), _between(ground.ways(cells), cells))
        lengths = np.zeros((len(poses) + 1, len(poses) + 1))
        lengths[1:, 1:] = self._ways[1]
        lengths[0, 1:] = _between(ground.ways(np.array([ground.start])), cells)[0]
        return [place - 1 for place in short_tour(np.where(np.isfinite(lengths), lengths, 1e6))]


def _between(ways: FloatArray, cells: Cells) -> FloatArray:
    """Return the lengths (m) of the ways to N cells out of those to all cells."""
    lengths: FloatArray = ways[:, cells[:, 0], cells[:, 1]]
    return lengths
