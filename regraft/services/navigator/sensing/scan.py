"""Laser scans as points."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray, Pose2D
from regraft.services import robot_parameters as usual


def outward(pose: Pose2D, points: FloatArray) -> FloatArray:
    """Return points (N, 2) of a frame in the outer one.

    `Pose2D.outward` does so too, but rounds differently: with that one every recorded search would be another.
    """
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    rotation = np.array([[cos, -sin], [sin, cos]])
    moved: FloatArray = points @ rotation.T + np.array([pose.x, pose.y])
    return moved


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One turn of a planar lidar, taken at `stamp` (s).

    `ranges` (N,) in m; beam i points at `angle_min + i * angle_increment` (rad) in the sensor's frame, which is at
    `sensor` in the base frame. Ranges that are not finite or outside [range_min, range_max) is no echo: some lidars
    report range_max for nothing.
    """

    stamp: float
    ranges: FloatArray
    angle_min: float = 0.0
    angle_increment: float = math.tau / 360
    sensor: Pose2D = field(default=Pose2D(*usual.LIDAR))
    range_min: float = usual.RANGE_MIN
    range_max: float = usual.RANGE_MAX

    def echoes(self) -> NDArray[np.bool_]:
        """Return which beams (N,) came back."""
        with np.errstate(invalid="ignore"):
            echo: NDArray[np.bool_] = (self.ranges >= self.range_min) & (self.ranges < self.range_max)
        return echo

    @property
    def all_around(self) -> bool:
        """Whether the beams look into every direction."""
        return len(self.ranges) * self.angle_increment >= math.tau - self.angle_increment / 2

    def too_near(self) -> FloatArray:
        """Return the bearings (K,; rad) at which something is nearer than can be measured: -inf, as in REP 117."""
        beams = np.flatnonzero(np.isneginf(self.ranges)).astype(np.float64)
        return self.angle_min + self.angle_increment * beams

    def nearest(self) -> float:
        """Return the range (m) of the nearest echo; inf if there is none."""
        return float(self.ranges[self.echoes()].min(initial=math.inf))

    def towards(self, points: FloatArray) -> FloatArray:
        """Return the range (m) measured towards each of (M, 2) points in the sensor's frame.

        It is inf where the beam did not come back, and 0 where there is no beam or no information.
        """
        bearing = np.mod(np.arctan2(points[:, 1], points[:, 0]) - self.angle_min, math.tau)
        if self.all_around:
            beam = np.rint(bearing / self.angle_increment).astype(int)
            beam = np.where(beam * self.angle_increment > math.tau - self.angle_increment / 2, 0, beam)
        else:
            # Only the right half of the first beam lies before it; all else before it is seen by no beam.
            bearing = np.where(bearing > math.tau - self.angle_increment / 2, 0.0, bearing)
            beam = np.rint(bearing / self.angle_increment).astype(int)
        there = beam < len(self.ranges)
        ranges = self.ranges[np.where(there, beam, 0)]
        nothing_there = ranges >= self.range_max
        told = np.where(ranges >= self.range_min, ranges, 0.0)
        measured: FloatArray = np.where(there, np.where(nothing_there, math.inf, told), 0.0)
        return measured

    def points(self) -> FloatArray:
        """Return the echoes as (M, 2) points (m) in the base frame at the time of the scan."""
        ranges = self.ranges
        echo = self.echoes()
        angles = self.angle_min + self.angle_increment * np.flatnonzero(echo)
        beams = np.column_stack([np.cos(angles), np.sin(angles)])
        return outward(self.sensor, ranges[echo, None] * beams)


def thin(points: FloatArray, origin: Pose2D, cell: float) -> FloatArray:
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
