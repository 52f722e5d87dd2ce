"""Headings of bodies: in odometry, in quaternions and in rotation matrices."""

import math

import numpy as np
import numpy.typing as npt


def wrap_heading(angle: float) -> float:
    """Return the same heading (rad) within [-pi, pi).

    It rounds differently from `regraft.planar.wrap_angle`; with that one every recorded run would be another.
    """
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def yaw_quaternion(yaw: float) -> npt.NDArray[np.float64]:
    """Return the unit quaternion (w, x, y, z) of a rotation about the vertical by yaw (rad)."""
    return np.array([math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)])


def yaw_of_matrix(rotation: npt.NDArray[np.float64]) -> float:
    """Return the heading (rad) in a rotation matrix given as 9 numbers, row by row."""
    return math.atan2(float(rotation[3]), float(rotation[0]))
