"""Poses and velocities on the ground plane (REP 103: x forward, y left, yaw counter-clockwise)."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class Pose2D:
    """A position (x, y in m) and a heading (yaw in rad, counter-clockwise from the x axis)."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True, slots=True)
class Twist2D:
    """Forward velocity v (m/s) and yaw rate w (rad/s), both in the robot's own frame."""

    v: float
    w: float


def wrap_angle(angle: float) -> float:
    """Return the same angle (rad) within [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def yaw_quaternion(yaw: float) -> npt.NDArray[np.float64]:
    """Return the unit quaternion (w, x, y, z) of a rotation about the vertical by yaw (rad)."""
    return np.array([math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)])


def yaw_of_matrix(rotation: npt.NDArray[np.float64]) -> float:
    """Return the heading (rad) in a rotation matrix given as 9 numbers, row by row."""
    return math.atan2(float(rotation[3]), float(rotation[0]))
