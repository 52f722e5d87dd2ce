"""Turns of a planar lidar, as the mapper uses them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray, Pose2D
from regraft.services import robot_parameters as usual


@lru_cache(maxsize=4)
def _beams(angle_min: float, angle_increment: float, count: int) -> FloatArray:
    angles = angle_min + angle_increment * np.arange(count)
    return np.column_stack([np.cos(angles), np.sin(angles)])


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One turn, taken at ``stamp`` (s) by a lidar at ``sensor`` in the base frame.

    ``ranges`` (n; m) are +inf where nothing echoed, and -inf where something is too near. Beam i looks along
    ``angle_min + i * angle_increment`` (rad) about the sensor's z axis.
    """

    stamp: float
    ranges: FloatArray
    sensor: Pose2D
    angle_min: float = 0.0
    angle_increment: float = math.tau / 360
    range_min: float = usual.RANGE_MIN
    range_max: float = usual.RANGE_MAX

    @property
    def beams(self) -> FloatArray:
        """The directions (n, 2) of the beams in the sensor's frame, as unit vectors."""
        return _beams(self.angle_min, self.angle_increment, len(self.ranges))

    @property
    def echoed(self) -> NDArray[np.bool_]:
        """Which beams (n) hit something within the lidar's reach."""
        ranges = self.ranges
        return np.isfinite(ranges) & (ranges >= self.range_min) & (ranges <= self.range_max)

    @property
    def silent(self) -> NDArray[np.bool_]:
        """Which beams (n) hit nothing within the lidar's reach; shorter ranges, also -inf, are no information."""
        # A range at the lidar's least may be rounded to single precision.
        silent: NDArray[np.bool_] = ~self.echoed & (self.ranges >= self.range_min * (1.0 - 1e-6))
        return silent

    def points(self) -> FloatArray:
        """Return the echoes (m, 2; m) in the base frame."""
        echoed = self.echoed
        return self.sensor.outward(self.ranges[echoed, None] * self.beams[echoed])
