"""A small exact room for tests: boxes, a lidar, a robot on a given way, and a mapper on a rig that watches."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.bus_schema.messages.health import Diagnostic
from regraft.planar import Pose2D
from regraft.services.mapper.component import MappingComponent
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.testing import Rig

MAPPERS: list[type[MappingComponent]] = [Mapper, OdometryMapper]
TICK = 0.05
TICKS_PER_SCAN = 4
RANGE = 3.5
NOISE = 0.01
MOUNT = Pose2D(-0.064, 0.0, 0.0)
Box = tuple[float, float, float, float]
"""Low x, low y, high x, high y (m)."""

WALLS: list[Box] = [(-2.6, -2.1, -2.5, 2.1), (2.0, -2.1, 2.1, 2.1), (-2.6, -2.1, 2.1, -2.0), (-2.6, 2.0, 2.1, 2.1)]
THINGS: list[Box] = [(-1.6, 1.1, -1.2, 1.5), (1.1, -1.4, 1.3, -1.2), (-0.2, 1.4, 0.3, 1.6)]


def cast(boxes: list[Box], pose: Pose2D, seed: int) -> NDArray[np.float32]:
    """Return the ranges (360; m) of a lidar at a pose, with noise; inf where nothing is near enough."""
    angles = pose.yaw + np.arange(360) * math.tau / 360
    with np.errstate(divide="ignore", over="ignore"):
        inverse = 1.0 / np.stack([np.cos(angles), np.sin(angles)])
    nearest = np.full(360, math.inf)
    for low_x, low_y, high_x, high_y in boxes:
        with np.errstate(over="ignore"):
            to_low = np.array([[low_x - pose.x], [low_y - pose.y]]) * inverse
            to_high = np.array([[high_x - pose.x], [high_y - pose.y]]) * inverse
        enters = np.minimum(to_low, to_high).max(axis=0)
        leaves = np.maximum(to_low, to_high).min(axis=0)
        hits = (enters <= leaves) & (leaves > 0.0)
        nearest = np.where(hits, np.minimum(nearest, np.maximum(enters, 0.0)), nearest)
    ranges = nearest + NOISE * np.random.default_rng(seed).standard_normal(360)
    return np.where((nearest < 0.12) | (nearest > RANGE), math.inf, np.clip(ranges, 0.12, RANGE)).astype(np.float32)


def true_cells(boxes: list[Box]) -> tuple[NDArray[np.int8], float, tuple[float, float]]:
    """Return occupancies, resolution and origin of the true map; a cell that a box touches is occupied."""
    cells = np.zeros((84, 94), np.int8)
    low_x, low_y = -2.6 + 0.05 * np.arange(94), -2.1 + 0.05 * np.arange(84)
    for box in boxes:
        rows = (low_y < box[3] - 1e-6) & (low_y + 0.05 > box[1] + 1e-6)
        columns = (low_x < box[2] - 1e-6) & (low_x + 0.05 > box[0] + 1e-6)
        cells[np.ix_(rows, columns)] = 100
    return cells, 0.05, (-2.6, -2.1)


def circle(seconds: float) -> Pose2D:
    """Return where the robot is on its way: round and round, at 0.2 m/s."""
    angle = 0.25 * seconds
    return Pose2D(0.8 * math.cos(angle) - 0.3, 0.8 * math.sin(angle), angle + math.pi / 2)


def exact(pose: Pose2D, seconds: float) -> Pose2D:
    """Return what an odometry without error says."""
    return pose


@dataclass
class Ride:
    """A robot that goes its way in the room, and what its mapper publishes."""

    rig: Rig
    cls: type[MappingComponent]
    parameters: dict[str, object] = field(default_factory=dict)
    way: Callable[[float], Pose2D] = circle
    odometry: Callable[[Pose2D, float], Pose2D] = exact
    boxes: list[Box] = field(default_factory=lambda: WALLS + THINGS)
    ticks: int = 0
    speaks: set[str] = field(default_factory=lambda: {"odometry", "scan"})
    spoil: Callable[[NDArray[np.float32]], NDArray[np.float32]] = lambda ranges: ranges
    truth: list[Pose2D] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.mapper = self.rig.add(self.cls, "mapper", self.parameters)
        self.localized = self.rig.collect("localization", sensors.Odometry)
        self.maps = self.rig.collect("map", maps.OccupancyGrid)
        self.told: list[Diagnostic] = []
        self.rig.bus.subscribe(self.rig.keys.diagnostics, lambda sample: self.told.append(_decoded(sample.payload)))

    @property
    def now(self) -> float:
        """Time (s) since the start."""
        return self.ticks * TICK

    @property
    def error(self) -> float:
        """How far (m) the localization is from the truth."""
        pose, truth = self.localized[-1].pose, self.truth[-1]
        return math.hypot(pose.x - truth.x, pose.y - truth.y)

    def go(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / TICK)):
            self.rig.advance(TICK)
            self.ticks += 1
            pose = self.way(self.now)
            self.truth.append(pose)
            if "odometry" in self.speaks:
                self.tell_odometry(pose)
            if "scan" in self.speaks and self.ticks % TICKS_PER_SCAN == 0:
                self.tell_scan(pose)

    def tell_odometry(self, pose: Pose2D) -> None:
        """Publish the odometry at a true pose."""
        read = self.odometry(pose, self.now)
        placed = geometry.Pose.planar(read.x, read.y, read.yaw)
        twist = geometry.Twist.planar(0.2, 0.25)
        self.rig.publish("odometry", sensors.Odometry(self.now, "odom", "base_link", placed, twist))

    def tell_scan(self, pose: Pose2D) -> None:
        """Publish a scan at a true pose."""
        ranges = self.spoil(cast(self.boxes, pose.compose(MOUNT), self.ticks))
        mount = geometry.Pose(geometry.Vector3(MOUNT.x, 0.0, 0.1))
        scan = sensors.LaserScan(self.now, "lidar", "base_link", mount, 0.0, math.tau / 360, 0.12, RANGE, ranges)
        self.rig.publish("scan", scan)

    def levels(self, subject: str) -> list[str]:
        """Return what was told of a subject: ok, warning, error."""
        return [told.level.value for told in self.told if told.subject == subject]

    def remove(self) -> object:
        """Stop the mapper; returns its state as another one gets it."""
        state = self.mapper.snapshot()
        self.rig.runtimes.pop("mapper").leave()
        return state


def _decoded(payload: bytes) -> Diagnostic:
    return codec.decode(payload, Diagnostic)
