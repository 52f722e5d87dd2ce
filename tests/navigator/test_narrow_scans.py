"""A scan with a narrow field of view, such as a depth camera's, proves nothing of what it does not look at."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from regraft.bus_schema.messages import geometry, sensors
from regraft.planar import FloatArray, Pose2D, Twist2D
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.maps.rays import insert
from regraft.services.mapper.maps.scan import Scan as MapperScan
from regraft.services.navigator.conversions import scan_of
from regraft.services.navigator.driving.local_controller import Manoeuvres, Situation
from regraft.services.navigator.driving.robot import Footprint, Limits
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.sensing.scan import Scan
from regraft.services.navigator.sensing.senses import ScanFault, ScanWatch
from regraft.services.navigator.sensing.sight import Sight
from regraft.services.sensor_checks import judge_scan, looks_all_around

from .world import Box, cast, rasterise

RADIUS = 0.25
EYE = Pose2D(0.2, 0.0, 0.0)
LEAST, REACH = 0.3, 2.5
HALF = math.radians(43.5)
BEAMS = 80
ROOM = [Box(3.0, -0.05, 6.0, 0.1), Box(3.0, 6.05, 6.0, 0.1), Box(-0.05, 3.0, 0.1, 6.0), Box(6.05, 3.0, 0.1, 6.0)]
PLANNER = GridPlanner(rasterise(ROOM, (124, 124), (-0.1, -0.1)))
AHEAD, BACK = Twist2D(0.2, 0.0), Twist2D(-0.2, 0.0)


@dataclass
class Robot:
    """A round robot with a depth camera, in a room."""

    pose: Pose2D = field(default_factory=lambda: Pose2D(3.0, 3.0, 0.0))
    boxes: list[Box] = field(default_factory=lambda: list(ROOM))
    time: float = 0.0
    sight: Sight = field(default_factory=lambda: Sight(RADIUS))
    watch: ScanWatch = field(default_factory=ScanWatch)

    def scan(self) -> Scan:
        """Return what the camera sees."""
        increment = 2 * HALF / BEAMS
        angles = -HALF + increment * (np.arange(BEAMS, dtype=np.float64) + 0.5)
        place = self.pose.compose(EYE)
        ranges = cast(self.boxes, place.position, place.yaw + angles)
        ranges = np.where(ranges < LEAST, -math.inf, np.where(ranges > REACH, math.inf, ranges))
        return Scan(self.time, ranges, float(angles[0]), increment, EYE, LEAST, REACH)

    def look(self, scan: Scan | None = None) -> None:
        """Look from where the robot is, a while later: so its pose has not jumped."""
        self.time += 1.0
        self.sight.absorb(self.time, self.pose, Twist2D(), scan or self.scan(), PLANNER)

    def fault(self, scan: Scan | None = None) -> ScanFault | None:
        """Return what is wrong with a scan from here."""
        self.time += 0.5
        self.watch.look(self.pose, scan or self.scan(), self.pose, PLANNER)
        self.watch.check(self.time, 10.0)
        return self.watch.fault

    def can_drive(self, twist: Twist2D) -> bool:
        """Return whether the robot may drive so for a while."""
        limits = Limits(max_velocity=0.5, wheel_speed=0.6)
        now = Situation(self.pose, Twist2D(), self.sight.obstacles, limits)
        return Manoeuvres(Footprint.disc(RADIUS)).can_drive(now, twist)

    def can_turn(self) -> bool:
        """Return whether the robot may turn in place by half a turn."""
        limits = Limits(max_velocity=0.5, wheel_speed=0.6)
        now = Situation(self.pose, Twist2D(), self.sight.obstacles, limits)
        return Manoeuvres(Footprint.disc(RADIUS)).can_turn(now, math.pi)


def uniform(robot: Robot, value: float) -> Scan:
    """Return a scan of equal ranges."""
    scan = robot.scan()
    return Scan(robot.time + 1.0, np.full(BEAMS, value), scan.angle_min, scan.angle_increment, EYE, LEAST, REACH)


def message(scan: Scan, step: int = 1) -> sensors.LaserScan:
    """Return the message of a scan, whose beams turn clockwise if `step` is -1."""
    last = scan.angle_min + (len(scan.ranges) - 1) * scan.angle_increment
    angle_min, increment = (scan.angle_min, scan.angle_increment) if step > 0 else (last, -scan.angle_increment)
    pose = geometry.Pose.planar(scan.sensor.x, scan.sensor.y, scan.sensor.yaw)
    ranges = scan.ranges[::step].astype(np.float32)
    return sensors.LaserScan(
        scan.stamp, "lidar", "base_link", pose, angle_min, increment, scan.range_min, scan.range_max, ranges
    )


def test_the_robot_does_not_back_up_into_a_wall_of_the_map_that_it_does_not_see() -> None:
    robot = Robot(Pose2D(0.35, 3.0, 0.0))
    robot.look()
    assert not robot.can_drive(BACK)
    assert robot.can_drive(AHEAD)
    assert robot.can_turn()


def test_the_robot_does_not_back_up_into_what_it_saw_before_it_turned() -> None:
    robot = Robot(boxes=[*ROOM, Box(3.7, 3.0, 0.1, 1.0)])
    robot.look()
    robot.pose = Pose2D(3.0, 3.0, math.pi)
    robot.look()
    assert robot.can_drive(AHEAD)
    robot.pose = Pose2D(3.3, 3.0, math.pi)
    robot.look()
    assert not robot.can_drive(BACK)


def test_what_was_forgotten_on_request_is_no_obstacle_but_the_map_s_are() -> None:
    robot = Robot(Pose2D(0.9, 3.0, math.pi), boxes=[*ROOM, Box(0.1, 3.0, 0.2, 1.0)])
    robot.look()
    robot.pose = Pose2D(0.5, 3.0, 0.0)
    robot.look()
    assert not robot.can_drive(BACK)
    assert robot.sight.forget(lambda places: np.ones(len(places), bool)) > 0
    assert robot.can_drive(Twist2D(-0.05, 0.0))
    robot.pose = Pose2D(0.33, 3.0, 0.0)
    assert not robot.can_drive(BACK)


def test_what_is_in_view_is_believed_against_the_map() -> None:
    robot = Robot(Pose2D(5.3, 3.0, 0.0))
    robot.look()
    assert not robot.can_drive(Twist2D(0.4, 0.0))
    robot.boxes = ROOM[:3]
    robot.look()
    assert robot.can_drive(Twist2D(0.4, 0.0))


def test_what_is_too_near_to_be_measured_blocks_the_way_ahead_and_nothing_else() -> None:
    robot = Robot(boxes=[*ROOM, Box(3.5, 3.0, 0.1, 1.0)])
    assert np.isneginf(robot.scan().ranges).any()
    robot.look()
    assert not robot.can_drive(AHEAD)
    assert robot.can_drive(BACK)
    assert robot.can_turn()


def test_it_is_an_obstacle_for_as_long_as_it_is_seen_and_is_not_remembered() -> None:
    robot = Robot()
    robot.look(uniform(robot, -math.inf))
    assert not robot.can_drive(AHEAD)
    assert len(robot.sight.unmapped) == 0
    robot.look(uniform(robot, 2.0))
    assert robot.can_drive(AHEAD)


def test_unmapped_things_out_of_view_stay_remembered_and_in_view_are_forgotten_when_gone() -> None:
    box = Box(4.2, 3.0, 0.3, 0.3)
    robot = Robot(boxes=[*ROOM, box])
    robot.look()
    known = len(robot.sight.unmapped)
    assert known > 2
    robot.boxes = list(ROOM)
    robot.pose = Pose2D(3.0, 3.0, 2.0)
    for _ in range(5):
        robot.look()
    assert len(robot.sight.unmapped) == known
    robot.pose = Pose2D(3.0, 3.0, 0.0)
    for _ in range(4):
        robot.look()
    assert len(robot.sight.unmapped) == 0


@pytest.mark.parametrize("width", [0.3, 1.5, 2.0, 6.0])
def test_nothing_is_measured_beside_the_field_of_view(width: float) -> None:
    count = 31
    increment = width / count
    scan = Scan(0.0, np.full(count, 1.0), -width / 2 + increment / 2, increment, Pose2D(), 0.1, 5.0)
    bearings = np.linspace(-math.pi, math.pi, 2001)
    points: FloatArray = np.column_stack([np.cos(bearings), np.sin(bearings)])
    measured = scan.towards(points)
    edge = 1e-6
    assert (measured[np.abs(bearings) < width / 2 - edge] == 1.0).all()
    assert (measured[np.abs(bearings) > width / 2 + edge] == 0.0).all()


def test_a_scan_that_turns_clockwise_shows_what_the_other_way_round_shows() -> None:
    there = Robot(Pose2D(3.5, 3.3, 0.4), boxes=[*ROOM, Box(4.5, 3.9, 0.2, 0.2)])
    one, other = (scan_of(message(there.scan(), step)) for step in (1, -1))
    assert np.allclose(one.points(), other.points())
    bearings = np.linspace(-math.pi, math.pi, 2001)
    points = np.column_stack([np.cos(bearings), np.sin(bearings)])
    assert np.array_equal(one.towards(points), other.towards(points))
    behind = Robot(Pose2D(0.35, 3.0, 0.0))
    behind.look(scan_of(message(replace(behind.scan(), stamp=1.0), -1)))
    assert not behind.can_drive(BACK)
    assert behind.can_drive(AHEAD)


def test_a_clockwise_scan_all_around_has_no_gap() -> None:
    clockwise = message(Scan(0.0, np.full(360, 1.0), 0.0, math.tau / 360, Pose2D(), 0.1, 5.0), -1)
    assert looks_all_around(clockwise)
    scan = scan_of(clockwise)
    bearings = np.linspace(-math.pi, math.pi, 2001)
    assert scan.all_around
    assert (scan.towards(np.column_stack([np.cos(bearings), np.sin(bearings)])) == 1.0).all()


@pytest.mark.parametrize("count", [0, 1, 80])
def test_beams_that_all_look_the_same_way_are_blindness(count: int) -> None:
    robot = Robot()
    scan = scan_of(message(replace(uniform(robot, 2.0), ranges=np.full(count, 2.0), angle_increment=0.0)))
    assert robot.fault(scan) is ScanFault.BLIND


def test_a_scan_all_around_has_no_gap() -> None:
    scan = Scan(0.0, np.full(360, 1.0), 0.0, math.tau / 360, Pose2D(), 0.1, 5.0)
    bearings = np.linspace(-math.pi, math.pi, 2001)
    assert scan.all_around
    assert (scan.towards(np.column_stack([np.cos(bearings), np.sin(bearings)])) == 1.0).all()


def test_a_camera_that_looks_into_the_open_is_not_blind_whatever_is_behind_the_robot() -> None:
    assert Robot(Pose2D(0.3, 3.0, 0.0)).fault() is None


def test_a_camera_that_misses_the_walls_ahead_is_blind() -> None:
    robot = Robot(Pose2D(4.8, 3.0, 0.0))
    assert robot.fault() is None
    assert robot.fault(uniform(robot, math.inf)) is ScanFault.BLIND


@pytest.mark.parametrize("value", [0.0, math.nan])
def test_ranges_that_cannot_be_are_blindness(value: float) -> None:
    robot = Robot()
    assert robot.fault(uniform(robot, value)) is ScanFault.BLIND


def test_a_camera_before_something_very_near_is_not_blind() -> None:
    robot = Robot()
    assert robot.fault(uniform(robot, -math.inf)) is None


def test_what_was_not_looked_at_is_known_to_a_successor() -> None:
    robot = Robot(Pose2D(0.35, 3.0, 0.0))
    robot.look()
    successor = Robot(robot.pose)
    successor.sight.restore(robot.sight.snapshot())
    assert not successor.can_drive(BACK)


def test_beams_without_information_free_no_ground_of_a_map() -> None:
    grid = Grid(0.05, (0.0, 0.0), 4.0, 20.0)
    for value in (0.0, -math.inf, math.nan):
        ranges = np.full(90, value)
        insert(grid, Pose2D(), MapperScan(0.0, ranges, Pose2D(), 0.0, math.tau / 90, 0.12, 1.5))
    assert (grid.per_cent() == -1).all()
    insert(grid, Pose2D(), MapperScan(0.0, np.full(90, math.inf), Pose2D(), 0.0, math.tau / 90, 0.12, 1.5))
    assert (grid.per_cent() == -1).sum() < grid.per_cent().size


def test_the_first_and_the_last_beam_of_a_narrow_scan_are_no_neighbours() -> None:
    ranges = np.array([1.0] * 10 + [np.inf] * 10, np.float32)
    assert judge_scan(ranges, 0.1, 0.06, all_around=False) is None
    found = judge_scan(ranges, 0.1, 0.06)
    assert found is not None
    assert found.fault == "dropouts"
