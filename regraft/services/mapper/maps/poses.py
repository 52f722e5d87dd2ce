"""Planar poses as rigid motions (REP 103: x forward, y left, yaw counter-clockwise)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def wrap_angle(angle: float) -> float:
    """Return the same angle (rad) within [-pi, pi]."""
    return math.remainder(angle, math.tau)


@dataclass(frozen=True, slots=True)
class Pose:
    """Where one frame stands in another: position (m) and heading (rad)."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def compose(self, other: Pose) -> Pose:
        """Return the pose, in the outer frame, of what stands at ``other`` in the frame that stands here."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            wrap_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> Pose:
        """Return where the outer frame stands in this one."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, -self.yaw)

    def to(self, other: Pose) -> Pose:
        """Return the motion that leads from here to ``other``, as seen from here."""
        return self.inverse().compose(other)

    def distance(self, other: Pose) -> float:
        """Return how far apart (m) two poses of one frame are."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def towards(self, other: Pose, share: float) -> Pose:
        """Return the pose at a share (0 to 1) of the way to a near one."""
        return Pose(
            self.x + share * (other.x - self.x),
            self.y + share * (other.y - self.y),
            wrap_angle(self.yaw + share * wrap_angle(other.yaw - self.yaw)),
        )

    def place(self, points: Points) -> Points:
        """Return points (n, 2; m) of the frame that stands here in the outer frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        x, y = points[:, 0], points[:, 1]
        return np.column_stack([self.x + cos * x - sin * y, self.y + sin * x + cos * y])
