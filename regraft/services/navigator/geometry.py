"""Planar poses, twists and changes of frame (REP 103: x forward, y left, yaw counter-clockwise)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """Position (m) and heading (rad) in a fixed frame."""

    x: float
    y: float
    yaw: float

    @property
    def position(self) -> Point:
        """The position alone, (x, y)."""
        return (self.x, self.y)


@dataclass(frozen=True, slots=True)
class Twist:
    """Forward velocity v (m/s) and turning rate w (rad/s) in the robot's base frame."""

    v: float = 0.0
    w: float = 0.0


def wrap_angle(angle: float) -> float:
    """Return the angle in (-pi, pi] that points the same way."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def to_fixed_frame(points: FloatArray, pose: Pose) -> FloatArray:
    """Move (N, 2) points from the frame that stands at `pose` to the frame in which `pose` is given."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    rotation = np.array([[cos, -sin], [sin, cos]])
    moved: FloatArray = points @ rotation.T + np.array([pose.x, pose.y])
    return moved


def to_base_frame(points: FloatArray, pose: Pose) -> FloatArray:
    """Move (N, 2) points from the fixed frame to the frame that stands at `pose`."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    rotation = np.array([[cos, -sin], [sin, cos]])
    moved: FloatArray = (points - np.array([pose.x, pose.y])) @ rotation
    return moved


def compose(frame: Pose, pose: Pose) -> Pose:
    """Return, in the frame in which `frame` is given, a pose that is given in `frame`."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    x, y = frame.x + cos * pose.x - sin * pose.y, frame.y + sin * pose.x + cos * pose.y
    return Pose(x, y, wrap_angle(frame.yaw + pose.yaw))


def inverse(frame: Pose) -> Pose:
    """Return where the frame stands in which `frame` is given, seen from `frame`."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    return Pose(-cos * frame.x - sin * frame.y, sin * frame.x - cos * frame.y, -frame.yaw)


def interpolate(before: Pose, after: Pose, fraction: float) -> Pose:
    """Return the pose that lies at `fraction` (0 to 1) of the way between two near poses."""
    return Pose(
        before.x + fraction * (after.x - before.x),
        before.y + fraction * (after.y - before.y),
        wrap_angle(before.yaw + fraction * wrap_angle(after.yaw - before.yaw)),
    )


def polyline_length(points: FloatArray) -> float:
    """Return the length (m) of the polyline through (N, 2) points."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) > 1 else 0.0
