"""What a whole drive to a goal promises, in a room with a lidar that measures with noise."""

import json
import math
from collections.abc import Callable

import numpy as np
import pytest

from regraft.planar import Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.driving.pursuit import PursuitController
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.follower import Command, Follower
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.polyline import polyline_length

from .world import FROG_BOXES, FROG_GOALS, Box, Robot, frog_map, rasterise

pytestmark = pytest.mark.slow

FROG_PLANNER = GridPlanner(frog_map())
ROOM = [
    Box(2.0, -0.05, 4.0, 0.1),
    Box(2.0, 4.05, 4.0, 0.1),
    Box(-0.05, 2.0, 0.1, 4.0),
    Box(4.05, 2.0, 0.1, 4.0),
]
ROOM_PLANNER = GridPlanner(rasterise(ROOM, (84, 84), (-0.1, -0.1)))
LONGEST = 12000  # ticks: far more than any drive may take


def drive(follower: Follower, robot: Robot, watch: Callable[[Command], None] = lambda command: None) -> Command:
    """Let the robot do what the follower says until the drive is over; return the last command."""
    for _ in range(LONGEST):
        command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
        watch(command)
        if command.done or command.failed:
            return command
        robot.drive(command.v, command.w)
    raise AssertionError(f"the drive neither arrives nor fails: {command}")


def random_start(seed: int) -> Robot:
    """Put the robot somewhere in the FROG room where it touches nothing."""
    noise = np.random.default_rng(seed)
    while True:
        x, y, yaw = noise.uniform([-1.7, -1.7, -math.pi], [1.7, 1.7, math.pi]).tolist()
        if FROG_PLANNER.clearance(np.array([[x, y]]))[0] > 0.28:
            return Robot(Pose2D(x, y, yaw), FROG_BOXES, noise)


@pytest.mark.parametrize("seed", [8])
def test_all_frog_goals_are_reached_from_anywhere_without_touching_anything(seed: int) -> None:
    robot = random_start(seed)
    follower = Follower(FROG_PLANNER, Limits(max_velocity=0.26 if seed % 2 else 0.18))
    for goal in FROG_GOALS:
        yaw = float(robot.noise.uniform(-math.pi, math.pi))
        follower.start(Pose2D(*goal, yaw))
        last = drive(follower, robot)
        assert last.done, last.reason
        # The goals lie inside objects, so the robot stands beside them.
        assert math.dist(robot.pose.position, goal) < 0.5
        assert math.dist(robot.pose.position, follower.path[-1]) <= 0.16
        assert abs(wrap_angle(robot.pose.yaw - yaw)) <= 0.15
    assert robot.collisions == []


def test_free_goal_is_reached_within_its_tolerances() -> None:
    robot = Robot(Pose2D(0.5, 0.5, 3.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.2, 2.4, 1.0))
    assert drive(follower, robot).done
    assert math.dist(robot.pose.position, (3.2, 2.4)) <= 0.08
    assert abs(robot.pose.yaw - 1.0) <= 0.15


def test_max_velocity_holds_at_all_times_also_when_it_changes_under_way() -> None:
    robot = random_start(3)
    follower = Follower(FROG_PLANNER, Limits(max_velocity=0.10))
    follower.start(Pose2D(1.8, 1.8, 0.0))

    def speed_up(command: Command) -> None:
        if robot.time < 10.0:
            assert abs(command.v) <= 0.10 + 1e-12
        else:
            follower.limits = Limits(max_velocity=0.20)
        assert abs(command.v) <= 0.20 + 1e-12

    assert drive(follower, robot, speed_up).done
    assert robot.fastest == pytest.approx(0.20)


def test_robot_that_may_hardly_drive_still_arrives() -> None:
    robot = Robot(Pose2D(1.0, 1.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits(max_velocity=0.02))
    follower.start(Pose2D(1.4, 1.5, 0.0))
    last = drive(follower, robot)
    assert last.done, last.reason
    assert last.recoveries == 0


def test_robot_that_may_drive_fast_again_after_a_slow_while_still_arrives() -> None:
    robot = Robot(Pose2D(1.0, 1.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits(max_velocity=0.005), PursuitController())
    follower.start(Pose2D(2.0, 1.0, 0.0))
    while robot.time < 90.0:
        command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
        robot.drive(command.v, command.w, 0.2)
    follower.limits = Limits()
    last = drive(follower, robot)
    assert last.done, last.reason


def test_robot_that_may_not_drive_waits_until_it_may() -> None:
    robot = Robot(Pose2D(1.0, 1.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits(max_velocity=0.0))
    follower.start(Pose2D(2.0, 2.0, 0.0))
    for _ in range(1000):
        command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
        robot.drive(command.v, command.w)
    assert robot.pose.position == (1.0, 1.0)
    assert command.phase == "driving"
    assert command.time_left == math.inf
    follower.limits = Limits()
    assert drive(follower, robot).done


def test_goal_behind_a_wall_is_reached_around_it() -> None:
    boxes = [*ROOM, Box(2.0, 1.4, 0.1, 2.8)]
    robot = Robot(Pose2D(1.2, 0.8, 0.0), boxes)
    follower = Follower(GridPlanner(rasterise(boxes, (84, 84), (-0.1, -0.1))), Limits())
    follower.start(Pose2D(2.8, 0.8, -1.5))
    assert drive(follower, robot).done
    assert robot.collisions == []


def test_unreachable_goal_fails_at_once_and_says_why() -> None:
    boxes = [*ROOM, Box(2.0, 2.0, 0.1, 4.0)]
    follower = Follower(GridPlanner(rasterise(boxes, (84, 84), (-0.1, -0.1))), Limits())
    follower.start(Pose2D(3.0, 2.0, 0.0))
    robot = Robot(Pose2D(1.0, 2.0, 0.0), boxes)
    command = follower.update(0.0, robot.pose, robot.twist, robot.scan())
    assert command.failed
    assert "no path from (1.000, 2.000) to (3.000, 2.000)" in command.reason
    assert (command.v, command.w) == (0.0, 0.0)


@pytest.mark.parametrize("offset", [-0.15])
def test_box_that_is_not_on_the_map_is_avoided(offset: float) -> None:
    robot = Robot(Pose2D(0.6, 2.0, 0.0), [*ROOM, Box(2.0, 2.0 + offset, 0.4, 0.6)])
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    last = drive(follower, robot)
    assert last.done, last.reason
    assert robot.collisions == []


@pytest.mark.parametrize("seed", range(2))
def test_clutter_that_is_not_on_the_map_is_never_touched(seed: int) -> None:
    robot = random_start(seed)
    x, y = robot.pose.position
    while len(robot.boxes) < len(FROG_BOXES) + 6:
        box = Box(*robot.noise.uniform([-2, -2, 0.05, 0.05], [2, 2, 0.4, 0.4]).tolist())
        clear_of_start = max(abs(box.x - x) - box.size_x / 2, abs(box.y - y) - box.size_y / 2) > 0.3
        clear_of_goal = max(abs(box.x - 1.8) - box.size_x / 2, abs(box.y + 1.7) - box.size_y / 2) > 0.35
        if clear_of_start and clear_of_goal:
            robot.boxes = [*robot.boxes, box]
    follower = Follower(FROG_PLANNER, Limits())
    follower.start(Pose2D(1.8, -1.7, 0.0))
    last = drive(follower, robot)
    assert last.done, last.reason
    assert robot.collisions == []


def test_someone_who_walks_into_the_way_stops_the_robot_and_leaving_lets_it_go_on() -> None:
    corridor = [Box(2.0, 1.5, 4.0, 0.1), Box(2.0, 2.5, 4.0, 0.1)]
    planner = GridPlanner(rasterise([*ROOM, *corridor], (84, 84), (-0.1, -0.1)))
    robot = Robot(Pose2D(0.6, 2.0, 0.0), [*ROOM, *corridor])
    follower = Follower(planner, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    stood = []

    def walk(command: Command) -> None:
        # Comes through the wall, a step at a time, stands in the way for a while and leaves.
        y = max(2.0, 2.9 - 0.5 * max(0.0, robot.time - 2.0)) + 0.5 * max(0.0, robot.time - 12.0)
        robot.boxes = [*ROOM, *corridor, Box(2.0, y, 0.3, 0.3)]
        if 8.0 < robot.time < 12.0:
            stood.append(command.v < 0.03)

    last = drive(follower, robot, walk)
    assert all(stood)
    assert last.done, last.reason
    assert robot.collisions == []


def test_someone_who_crosses_in_front_is_not_run_into() -> None:
    robot = Robot(Pose2D(0.6, 2.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))

    def cross(command: Command) -> None:
        robot.boxes = [*ROOM, Box(1.8, 3.2 - 0.25 * robot.time, 0.3, 0.3)]

    assert drive(follower, robot, cross).done
    assert robot.collisions == []


def test_way_that_stays_blocked_fails_with_the_reason_after_bounded_recoveries() -> None:
    robot = Robot(Pose2D(0.6, 2.0, 0.0), [*ROOM, Box(2.0, 2.0, 0.1, 4.0)])
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    last = drive(follower, robot)
    assert last.failed
    assert last.recoveries == 6
    assert "those seen leave no way" in last.reason
    assert robot.collisions == []


def test_two_ways_that_are_both_blocked_do_not_keep_the_robot_going_forever() -> None:
    divider = Box(2.0, 2.0, 0.2, 1.8)
    robot = Robot(Pose2D(0.6, 2.0, 0.0), [*ROOM, divider, Box(2.0, 0.5, 0.2, 1.2), Box(2.0, 3.5, 0.2, 1.2)])
    follower = Follower(GridPlanner(rasterise([*ROOM, divider], (84, 84), (-0.1, -0.1))), Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    assert drive(follower, robot).failed
    assert robot.collisions == []


def test_robot_without_scans_stands_and_fails_after_a_while() -> None:
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.0, 3.0, 0.0))
    commands = [follower.update(0.05 * i, Pose2D(1.0, 1.0, 0.0), Twist2D(), None) for i in range(250)]
    assert all((command.v, command.w) == (0.0, 0.0) for command in commands)
    assert commands[150].phase == "waiting"
    assert commands[150].faults[0].subject == "scan"
    assert commands[-1].failed
    assert "no laser scan" in commands[-1].reason


def test_lidar_that_falls_silent_stops_the_robot() -> None:
    robot = Robot(Pose2D(0.6, 2.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    for _ in range(60):
        command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
        robot.drive(command.v, command.w)
    assert command.v > 0.1
    scan = robot.scan()
    for _ in range(18):
        command = follower.update(robot.time, robot.pose, robot.twist, scan)
        robot.drive(command.v, command.w)
    assert (command.v, command.w) == (0.0, 0.0)


def test_distance_and_time_left_shrink_to_nothing() -> None:
    robot = Robot(Pose2D(0.6, 2.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    left: list[tuple[float, float]] = []
    drive(follower, robot, lambda command: left.append((command.distance_left, command.time_left)))
    assert left[0][0] == pytest.approx(2.8, abs=0.1)
    assert left[0][1] == pytest.approx(2.8 / 0.26, rel=0.2)
    assert all(later[0] <= earlier[0] + 0.02 for earlier, later in zip(left, left[20:], strict=False))
    assert left[-1] == (0.0, 0.0)


def test_cancelled_drive_brakes() -> None:
    robot = Robot(Pose2D(0.6, 2.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 2.0, 0.0))
    for _ in range(40):
        command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
        robot.drive(command.v, command.w)
    follower.cancel()
    command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
    assert (command.v, command.w, command.phase) == (0.0, 0.0, "idle")


def test_new_map_with_a_wall_in_the_way_gives_a_new_path() -> None:
    boxes = [*ROOM, Box(2.0, 1.4, 0.1, 2.8)]
    robot = Robot(Pose2D(0.6, 1.0, 0.0), ROOM)
    follower = Follower(ROOM_PLANNER, Limits())
    follower.start(Pose2D(3.4, 1.0, 0.0))
    follower.update(robot.time, robot.pose, robot.twist, robot.scan())
    before = polyline_length(follower.path)
    follower.planner = GridPlanner(rasterise(boxes, (84, 84), (-0.1, -0.1)))
    follower.update(robot.time, robot.pose, robot.twist, robot.scan())
    assert polyline_length(follower.path) > before + 1.0


def cluttered_drive(seed: int) -> tuple[Follower, Robot]:
    robot = random_start(seed)
    robot.boxes = [*FROG_BOXES, Box(0.3, -0.6, 0.3, 0.3), Box(-0.4, 0.4, 0.2, 0.3)]
    follower = Follower(FROG_PLANNER, Limits())
    follower.start(Pose2D(1.8, 1.8, 0.5))
    return follower, robot


def test_equal_drives_are_equal_to_the_last_bit() -> None:
    poses = []
    for _ in range(2):
        follower, robot = cluttered_drive(5)
        drive(follower, robot)
        poses.append((robot.pose, robot.time))
    assert poses[0] == poses[1]


@pytest.mark.parametrize("ticks", [3, 303])
def test_restored_follower_continues_as_the_original_would(ticks: int) -> None:
    original, robot = cluttered_drive(5)
    for _ in range(ticks):
        command = original.update(robot.time, robot.pose, robot.twist, robot.scan())
        robot.drive(command.v, command.w)
    successor = Follower(GridPlanner(frog_map()), Limits())
    successor.restore(json.loads(json.dumps(original.snapshot())))
    for _ in range(150):
        command = original.update(robot.time, robot.pose, robot.twist, robot.scan())
        assert successor.update(robot.time, robot.pose, robot.twist, robot.scan()) == command
        robot.drive(command.v, command.w)
    assert successor.snapshot() == original.snapshot()


def test_state_of_another_version_is_refused() -> None:
    follower = Follower(ROOM_PLANNER, Limits())
    with pytest.raises(ValueError, match="version 99"):
        follower.restore({**follower.snapshot(), "version": 99})
