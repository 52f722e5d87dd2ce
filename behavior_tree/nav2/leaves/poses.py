"""Conditions that compare places."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from ...nodes.leaf import Condition
from ...nodes.node import NodeSetup
from ...nodes.ports import Input
from ..geometry import Position, poses_of, position_of, same


class ArePosesNear(Condition):
    """Holds while two places are near each other; both have to be in one frame."""

    ref_pose = Input[Any](description="one place")
    target_pose = Input[Any](description="the other one")
    global_frame = Input(str, default="", description="for the pose's source, not used here")
    tolerance = Input(float, default=0.5, description="how near, in metres")

    def holds(self) -> bool:
        """Return whether they are."""
        return math.dist(position_of(self.ref_pose), position_of(self.target_pose)) <= self.tolerance


class IsGoalNearby(Condition):
    """Holds while the rest of a path, from the pose nearest to the robot on, is short."""

    followed = Input[Any](name="path", description="the path")
    proximity_threshold = Input(float, default=1.0, description="how short, in metres")
    max_robot_pose_search_dist = Input(
        float, default=-1.0, description="how far along the path from the last nearest pose to look, in metres"
    )
    global_frame = Input(str, default="", description="for the pose's source, not used here")
    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._path: Any = None
        self._places: Sequence[Position] = ()
        self._first = 0

    def holds(self) -> bool:
        """Return whether the goal is nearby; not without a path, nor while the robot's pose is unknown."""
        path, pose = self.read_port_or("path"), self.read_port_or("pose")
        if pose is None or not len(poses_of(path)):
            return False
        search = self.max_robot_pose_search_dist
        if not same(path, self._path):
            self._path, self._first = path, 0
            self._places = [position_of(each) for each in poses_of(path)]
        if search < 0.0:
            self._first = 0
        self._first = self._nearest(position_of(pose), search)
        return _length(self._places[self._first :]) < self.proximity_threshold

    def _nearest(self, here: Position, search: float) -> int:
        best, least, travelled = self._first, math.inf, 0.0
        for index in range(self._first, len(self._places)):
            if index > self._first:
                travelled += math.dist(self._places[index - 1], self._places[index])
            if 0.0 <= search < travelled:
                break
            distance = math.dist(here, self._places[index])
            if distance < least:
                best, least = index, distance
        return best


class IsWithinPathTrackingBounds(Condition):
    """Holds while the robot is near enough to its path, and looks along it; also while nothing is known about it."""

    max_error_left = Input(float, default=0.5, description="in metres")
    max_error_right = Input(float, default=0.5, description="in metres")
    max_error_heading = Input(float, default=3.14, description="in radians")
    tracking_feedback = Input[Any](description="what FollowPath reports")

    def holds(self) -> bool:
        """Return whether position and heading are within the bounds."""
        feedback = self.read_port_or("tracking_feedback")
        if feedback is None:
            return True
        aside, turned = (_field(feedback, f"{name}_tracking_error") for name in ("position", "heading"))
        most = self.max_error_left if aside >= 0.0 else self.max_error_right
        return abs(aside) <= abs(most) and abs(turned) <= abs(self.max_error_heading)


def _length(places: Sequence[Position]) -> float:
    return sum(math.dist(first, second) for first, second in pairwise(places))


def _field(feedback: Any, name: str) -> float:
    value: Any = feedback.get(name) if isinstance(feedback, dict) else getattr(feedback, name, None)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{feedback!r} is no tracking feedback; it needs {name}") from None
