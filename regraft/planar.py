"""Poses, twists and points in the plane (REP 103: x forward, y left, yaw counter-clockwise)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Point = tuple[float, float]


def wrap_angle(angle: float) -> float:
    """Return the angle (rad) in (-pi, pi] that points the same way."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


@dataclass(frozen=True, slots=True)
class Pose2D:
    """A frame in another, the outer one: position (m) and heading (rad)."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def position(self) -> Point:
        """The position alone, (x, y)."""
        return (self.x, self.y)

    def compose(self, inner: Pose2D) -> Pose2D:
        """Return in the outer frame a pose that is given in this frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(
            self.x + cos * inner.x - sin * inner.y,
            self.y + sin * inner.x + cos * inner.y,
            wrap_angle(self.yaw + inner.yaw),
        )

    def inverse(self) -> Pose2D:
        """Return the outer frame as seen from this one."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, -self.yaw)

    def to(self, other: Pose2D) -> Pose2D:
        """Return the motion that leads from here to ``other``, as seen from here."""
        return self.inverse().compose(other)

    def distance(self, other: Pose2D) -> float:
        """Return the distance (m) between two poses of one frame."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def interpolate(self, other: Pose2D, fraction: float) -> Pose2D:
        """Return the pose at ``fraction`` (0 to 1) of the way to a near one."""
        return Pose2D(
            self.x + fraction * (other.x - self.x),
            self.y + fraction * (other.y - self.y),
            wrap_angle(self.yaw + fraction * wrap_angle(other.yaw - self.yaw)),
        )

    def outward(self, points: FloatArray) -> FloatArray:
        """Return points (N, 2) of this frame in the outer frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        x, y = points[:, 0], points[:, 1]
        return np.column_stack([self.x + cos * x - sin * y, self.y + sin * x + cos * y])

    def inward(self, points: FloatArray) -> FloatArray:
        """Return points (N, 2) of the outer frame in this frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        rotation = np.array([[cos, -sin], [sin, cos]])
        moved: FloatArray = (points - np.array([self.x, self.y])) @ rotation
        return moved


@dataclass(frozen=True, slots=True)
class Twist2D:
    """Forward velocity v (m/s) and turning rate w (rad/s) in a robot's own frame."""

    v: float = 0.0
    w: float = 0.0
