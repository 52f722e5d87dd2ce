"""The odometry of the last moments, and what is wrong with it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

from regraft.planar import Pose2D, wrap_angle
from regraft.services import robot_parameters as usual

KEPT = 2.0
"""s of odometry that are remembered, for scans that come late."""
TOO_FAST, TOO_FAST_TURN = 4.0, 2.2
"""Times the robot's limits: wheels that spin freely seem faster than the robot can be, but not so much."""
SLACK, SLACK_TURN = 0.05, 0.1
"""m and rad that a pose may be off at any rate."""


@dataclass(frozen=True, slots=True)
class Jump:
    """The odometry went from one pose to another faster than a robot can."""

    before: Pose2D
    after: Pose2D


class OdometryLog:
    """Remembers poses in the odometry's frame by their stamps (s).

    The limits are how fast the robot can drive (m/s) and turn (rad/s).
    """

    def __init__(
        self, velocity_limit: float = usual.MAX_VELOCITY, turn_rate_limit: float = usual.MAX_TURN_RATE
    ) -> None:
        self._fastest, self._fastest_turn = TOO_FAST * velocity_limit, TOO_FAST_TURN * turn_rate_limit
        self._stamps: deque[float] = deque()
        self._poses: deque[Pose2D] = deque()

    @property
    def newest(self) -> tuple[float, Pose2D] | None:
        """The newest stamp and pose, None before the first."""
        return (self._stamps[-1], self._poses[-1]) if self._stamps else None

    def add(self, stamp: float, pose: Pose2D) -> Jump | None:
        """Take in a pose; returns the jump if it is one, and the poses before it are then forgotten.

        A stamp that is not newer than the newest is taken for a repetition, and ignored.
        """
        jump = None
        if self._stamps:
            elapsed = stamp - self._stamps[-1]
            if elapsed <= 0.0:
                return None
            last = self._poses[-1]
            far = last.distance(pose) > self._fastest * elapsed + SLACK
            if far or abs(wrap_angle(pose.yaw - last.yaw)) > min(self._fastest_turn * elapsed + SLACK_TURN, math.pi):
                jump = Jump(last, pose)
                self.clear()
        self._stamps.append(stamp)
        self._poses.append(pose)
        while self._stamps[0] < stamp - KEPT:
            self._stamps.popleft()
            self._poses.popleft()
        return jump

    def clear(self) -> None:
        """Forget all poses."""
        self._stamps.clear()
        self._poses.clear()

    def at(self, stamp: float) -> Pose2D | None:
        """Return the pose at a time (s), between two entries in proportion; None outside of what is remembered."""
        after = bisect_left(self._stamps, stamp)
        if after == len(self._stamps):
            return None
        if self._stamps[after] == stamp:
            return self._poses[after]
        if after == 0:
            return None
        before = after - 1
        share = (stamp - self._stamps[before]) / (self._stamps[after] - self._stamps[before])
        return self._poses[before].interpolate(self._poses[after], share)
