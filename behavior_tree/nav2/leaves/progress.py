"""Conditions about time and way."""

import math
from typing import Any

from ...nodes.leaf import Condition
from ...nodes.node import NodeSetup
from ...nodes.ports import Input
from ...status import IDLE
from ..geometry import Position, position_of, same


class TimeExpired(Condition):
    """Holds once whenever a time has passed since the start or since it last held."""

    seconds = Input(float, default=1.0, description="the time")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._since = 0.0

    def holds(self) -> bool:
        """Return whether the time is over; not at the start."""
        now = self.runtime.clock.now()
        is_over = self.status != IDLE and now - self._since >= self.seconds
        if self.status == IDLE or is_over:
            self._since = now
        return is_over


class PathExpiringTimer(Condition):
    """Holds once whenever a path is older than a time; another path starts the time afresh, a reset does not."""

    seconds = Input(float, default=1.0, description="the time")
    followed = Input[Any](name="path", description="the path that is followed")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._since: float | None = None
        self._known: Any = None

    def holds(self) -> bool:
        """Return whether the path is too old; not at the first tick of all."""
        now, path = self.runtime.clock.now(), self.read_port_or("path")
        if self._since is None or not same(path, self._known):
            self._since, self._known = now, path
            return False
        is_over = now - self._since >= self.seconds
        if is_over:
            self._since = now
        return is_over


class DistanceTraveled(Condition):
    """Holds once whenever the robot has moved so far since the start or since it last held.

    The distance is as the crow flies.
    """

    distance = Input(float, default=1.0, description="in metres")
    global_frame = Input(str, default="", description="for the pose's source, not used here")
    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._start: Position | None = None

    def holds(self) -> bool:
        """Return whether the robot is far enough; not at the start, nor while its pose is unknown."""
        pose = self.read_port_or("pose")
        here = None if pose is None else position_of(pose)
        if self.status == IDLE or self._start is None:
            self._start = here
            return False
        if here is None or math.dist(self._start, here) < self.distance:
            return False
        self._start = here
        return True
