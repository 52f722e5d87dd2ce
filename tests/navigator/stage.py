"""A navigator component on a rig, with a small exact robot around it whose senses can be made to fail."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.bus_schema.messages.geometry import FramedPose, Twist
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.component.component import Component
from regraft.component.goal import Goal
from regraft.planar import Pose2D
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.sensing.scan import Scan
from regraft.testing import Rig

from .world import Box, Robot, rasterise

TICK = 0.05
Drive = Goal[Arrival, NavigationProgress]

ROOM = [
    Box(2.0, -0.05, 4.0, 0.1),
    Box(2.0, 4.05, 4.0, 0.1),
    Box(-0.05, 2.0, 0.1, 4.0),
    Box(4.05, 2.0, 0.1, 4.0),
]


def room_map(boxes: list[Box]) -> OccupancyGrid:
    """Return the map of some boxes in and around a room of 4 x 4 m."""
    return rasterise(boxes, (84, 84), (-0.1, -0.1))


@dataclass
class Stage:
    """What surrounds the navigator. Time passes by `run`; what fails is set on the fields."""

    rig: Rig
    navigator: Component
    robot: Robot
    commands: list[Twist]
    diagnostics: list[Diagnostic]
    correction: Pose2D = field(default_factory=lambda: Pose2D(0.0, 0.0, 0.0))
    """By how much the pose in the map is off, as seen from the map."""
    scans: bool = True
    odometry: bool = True
    frozen_odometry: bool = False
    lost_beams: float = 0.0
    """Share of the beams that do not come back."""
    frozen_scan: bool = False
    motors: bool = True
    _shown: tuple[Pose2D, Twist] | None = None
    _ranges: Scan | None = None
    _scanned_at: float = -1.0

    @classmethod
    def of(
        cls,
        rig: Rig,
        kind: type[Component],
        start: Pose2D,
        boxes: list[Box] | None = None,
        parameters: dict[str, Any] | None = None,
    ) -> Stage:
        """Put a navigator and a robot into a room of which the map is known."""
        robot = Robot(start, ROOM if boxes is None else boxes)
        navigator = rig.add(kind, "navigator", parameters)
        diagnostics: list[Diagnostic] = []
        rig.bus.subscribe(
            rig.keys.diagnostics, lambda sample: diagnostics.append(codec.decode(sample.payload, Diagnostic))
        )
        stage = cls(rig, navigator, robot, rig.collect("velocity", Twist), diagnostics)
        stage.show_map(room_map(robot.boxes))
        stage.run(0.5)
        return stage

    def show_map(self, grid: OccupancyGrid) -> None:
        """Publish a map."""
        origin = geometry.Pose.planar(grid.origin_x, grid.origin_y, 0.0)
        self.rig.publish("map", maps.OccupancyGrid(self.robot.time, "map", grid.resolution, origin, grid.cells))

    def send(self, x: float, y: float, yaw: float = 0.0) -> Drive:
        """Send the robot to a pose."""
        goal = NavigateTo(FramedPose("map", geometry.Pose.planar(x, y, yaw)))
        return self.rig.goal("navigate_to", goal, Arrival, NavigationProgress)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / TICK)):
            self._tick()

    def finish(self, drive: Drive, within: float = 120.0) -> Arrival:
        """Let time pass until a drive has ended."""
        end = self.robot.time + within
        while not drive.done and self.robot.time < end:
            self._tick()
        assert drive.result is not None, drive.error or "the drive does not end"
        return drive.result

    def _tick(self) -> None:
        before = len(self.commands)
        self._publish()
        self.rig.advance(TICK)
        told = self.commands[-1] if len(self.commands) > before else Twist()
        if not self.motors:
            told = Twist()
        self.robot.drive(told.forward, told.turn, TICK)

    def _publish(self) -> None:
        now = self.robot.time
        if self._shown is None or not self.frozen_odometry:
            twist = Twist.planar(self.robot.twist.v, self.robot.twist.w)
            self._shown = self.correction.compose(self.robot.pose), twist
        if self.odometry:
            pose, twist = self._shown
            place = geometry.Pose.planar(pose.x, pose.y, pose.yaw)
            self.rig.publish("odometry", sensors.Odometry(now, "map", "base_link", place, twist))
        if self.scans and now - self._scanned_at > 0.2 - 1e-9:
            self._scanned_at = now
            self.rig.publish("scan", self._scan(now))

    def _scan(self, now: float) -> sensors.LaserScan:
        if self._ranges is None or not self.frozen_scan:
            self._ranges = self.robot.scan()
        scan = self._ranges
        lost = self.robot.noise.random(len(scan.ranges)) < self.lost_beams
        ranges = np.where(lost, math.inf, scan.ranges).astype(np.float32)
        place = geometry.Pose.planar(scan.sensor.x, scan.sensor.y, 0.0)
        return sensors.LaserScan(
            now, "lidar", "base_link", place, 0.0, scan.angle_increment, scan.range_min, scan.range_max, ranges
        )
