"""A small exact world for tests: boxes, a ray-cast lidar, a kinematic robot; and the FROG room."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from regraft.planar import FloatArray, Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.driving.robot import Footprint, Limits
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.sensing.scan import Scan

SENSOR = Pose2D(-0.064, 0.0, 0.0)
RANGE = 3.5


@dataclass(frozen=True)
class Box:
    """An upright box, sides along the axes."""

    x: float
    y: float
    size_x: float
    size_y: float

    @property
    def low(self) -> tuple[float, float]:
        return (self.x - self.size_x / 2, self.y - self.size_y / 2)

    @property
    def high(self) -> tuple[float, float]:
        return (self.x + self.size_x / 2, self.y + self.size_y / 2)


FROG_BOXES = [
    Box(-2.426, 0.06, 0.15, 5.0),
    Box(2.424, 0.06, 0.15, 5.0),
    Box(-0.001, -2.365, 5.0, 0.15),
    Box(-0.001, 2.485, 5.0, 0.15),
    Box(1.029, 0.543, 0.5, 0.4),
    Box(1.022, 0.845, 0.25, 0.2),
    Box(-1.177, 0.463, 0.25, 0.2),
    Box(-0.004, 1.112, 0.25, 0.2),
    Box(-0.8567, -1.2287, 0.14, 0.14),  # the hydrant
]
# Taken from a map of objects, so they lie in or at the objects.
FROG_GOALS = [(-0.105, 1.155), (0.795, 0.680), (-1.305, 0.505), (-0.855, -1.195)]


def rasterise(boxes: list[Box], shape: tuple[int, int], origin: tuple[float, float]) -> OccupancyGrid:
    """Draw boxes on a map of 0.05 m cells; a cell that a box touches is occupied."""
    cells = np.zeros(shape, np.int8)
    low_y, low_x = (origin[i] + 0.05 * np.arange(shape[1 - i]) for i in (1, 0))
    for box in boxes:
        rows = (low_y < box.high[1] - 1e-9) & (low_y + 0.05 > box.low[1] + 1e-9)
        columns = (low_x < box.high[0] - 1e-9) & (low_x + 0.05 > box.low[0] + 1e-9)
        cells[np.ix_(rows, columns)] = 100
    return OccupancyGrid(cells, 0.05, *origin)


def frog_map() -> OccupancyGrid:
    return rasterise(FROG_BOXES, (96, 96), (-2.38, -2.33))


def cast(boxes: list[Box], origin: tuple[float, float], angles: FloatArray) -> FloatArray:
    """Return the distances to the nearest box along rays, inf where there is none."""
    nearest = np.full(len(angles), math.inf)
    with np.errstate(divide="ignore"):
        inverse = 1.0 / np.stack([np.cos(angles), np.sin(angles)])
    for box in boxes:
        to_low = (np.array(box.low) - origin)[:, None] * inverse
        to_high = (np.array(box.high) - origin)[:, None] * inverse
        enters = np.minimum(to_low, to_high).max(axis=0)
        leaves = np.maximum(to_low, to_high).min(axis=0)
        hits = (enters <= leaves) & (leaves > 0.0)
        nearest = np.where(hits, np.minimum(nearest, np.maximum(enters, 0.0)), nearest)
    return nearest


def touches(outline: Footprint, pose: Pose2D, box: Box) -> bool:
    """Tell whether the robot overlaps a box (separating axes of two rectangles)."""
    gap_x, gap_y = abs(pose.x - box.x) - box.size_x / 2, abs(pose.y - box.y) - box.size_y / 2
    if max(gap_x, gap_y) > outline.circumradius:
        return False
    forward = np.array([math.cos(pose.yaw), math.sin(pose.yaw)])
    left = np.array([-forward[1], forward[0]])
    half_length, half_width = (outline.front + outline.rear) / 2, outline.half_width
    centre = np.array([pose.x, pose.y]) + (outline.front - outline.rear) / 2 * forward
    offset, half = np.array([box.x, box.y]) - centre, np.array([box.size_x, box.size_y]) / 2
    for axis in (np.array([1.0, 0.0]), np.array([0.0, 1.0]), forward, left):
        reach = half_length * abs(forward @ axis) + half_width * abs(left @ axis) + half @ np.abs(axis)
        if abs(offset @ axis) > reach:
            return False
    return True


@dataclass
class Robot:
    """A differential drive without slip that saturates its wheels and follows commands at once."""

    pose: Pose2D
    boxes: list[Box]
    noise: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))
    time: float = 0.0
    twist: Twist2D = field(default_factory=Twist2D)
    outline: Footprint = field(default_factory=Footprint)
    limits: Limits = field(default_factory=lambda: replace(Limits(), max_velocity=1.0, max_turn_rate=9.0))
    fastest: float = 0.0
    collisions: list[tuple[Pose2D, Box]] = field(default_factory=list)
    _scan: Scan | None = None

    def scan(self) -> Scan:
        """Return the latest scan: 360 beams at 5 Hz, noise 0.01 m."""
        if self._scan is None or self.time - self._scan.stamp > 0.2 - 1e-9:
            cos, sin = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
            origin = (self.pose.x + SENSOR.x * cos, self.pose.y + SENSOR.x * sin)
            ranges = cast(self.boxes, origin, self.pose.yaw + np.arange(360) * math.tau / 360)
            ranges = ranges + self.noise.normal(0.0, 0.01, 360)
            ranges = np.where((ranges < 0.12) | (ranges > RANGE), math.inf, ranges)
            self._scan = Scan(self.time, ranges, sensor=SENSOR)
        return self._scan

    def drive(self, v: float, w: float, period: float = 0.05) -> None:
        """Move for a period under a command, as the wheels can, and note what is touched."""
        self.twist = self.limits.saturate(Twist2D(v, w))
        self.fastest = max(self.fastest, abs(self.twist.v))
        middle = self.pose.yaw + self.twist.w * period / 2
        self.pose = Pose2D(
            self.pose.x + self.twist.v * period * math.cos(middle),
            self.pose.y + self.twist.v * period * math.sin(middle),
            wrap_angle(self.pose.yaw + self.twist.w * period),
        )
        self.time += period
        self.collisions += [(self.pose, box) for box in self.boxes if touches(self.outline, self.pose, box)]
