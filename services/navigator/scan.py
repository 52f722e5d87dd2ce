"""Laser scans as points."""

import math
from dataclasses import dataclass, field

import numpy as np

from services.navigator.geometry import FloatArray, Pose, to_fixed_frame


@dataclass(frozen=True, slots=True)
class Scan:
    """One turn of a planar lidar, taken at `stamp` (s).

    `ranges` (N,) in m; beam i points at `angle_min + i * angle_increment` (rad) in the sensor's frame,
    which stands at `sensor` in the base frame. What is not finite or outside [range_min, range_max] is
    no echo.
    """

    stamp: float
    ranges: FloatArray
    angle_min: float = 0.0
    angle_increment: float = math.tau / 360
    sensor: Pose = field(default=Pose(-0.064, 0.0, 0.0))
    range_min: float = 0.12
    range_max: float = 3.5

    def points(self) -> FloatArray:
        """Return the echoes as (M, 2) points (m) in the base frame at the time of the scan."""
        ranges = np.asarray(self.ranges, dtype=np.float64)
        echo = np.isfinite(ranges) & (ranges >= self.range_min) & (ranges <= self.range_max)
        angles = self.angle_min + self.angle_increment * np.flatnonzero(echo)
        beams = np.column_stack([np.cos(angles), np.sin(angles)])
        return to_fixed_frame(ranges[echo, None] * beams, self.sensor)


def thin(points: FloatArray, origin: Pose, cell: float) -> FloatArray:
    """Keep of (N, 2) points, in each square of side `cell` (m), only the one nearest to `origin`."""
    if not len(points):
        return points
    by_distance = np.argsort(np.hypot(points[:, 0] - origin.x, points[:, 1] - origin.y), kind="stable")
    nearest_first = points[by_distance]
    squares = np.floor(nearest_first / cell).astype(np.int64)
    squares -= squares.min(axis=0)
    _, first = np.unique(squares[:, 0] * (squares[:, 1].max() + 1) + squares[:, 1], return_index=True)
    thinned: FloatArray = nearest_first[np.sort(first)]
    return thinned
