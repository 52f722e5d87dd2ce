"""What the robot's memory of obstacles promises."""

import numpy as np
import pytest

from regraft.planar import Pose2D, Twist2D
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.sensing.scan import Scan
from regraft.services.navigator.sensing.sight import Sight

from .world import Box, Robot, rasterise

ROOM = [
    Box(2.0, -0.05, 4.0, 0.1),
    Box(2.0, 4.05, 4.0, 0.1),
    Box(-0.05, 2.0, 0.1, 4.0),
    Box(4.05, 2.0, 0.1, 4.0),
]
PLANNER = GridPlanner(rasterise(ROOM, (84, 84), (-0.1, -0.1)))
POSE = Pose2D(1.0, 2.0, 0.3)
BOX = Box(2.0, 2.0, 0.3, 0.3)


def look(sight: Sight, robot: Robot, pose: Pose2D | None = None) -> None:
    """Let the robot look around at its time."""
    sight.absorb(robot.time, pose or robot.pose, robot.twist, robot.scan(), PLANNER)


def test_walls_of_the_map_are_obstacles_but_not_unmapped_ones() -> None:
    sight = Sight()
    look(sight, Robot(POSE, ROOM))
    assert len(sight.obstacles) > 50
    assert len(sight.unmapped) == 0


def test_box_that_the_map_lacks_is_remembered_where_it_is() -> None:
    sight = Sight()
    look(sight, Robot(POSE, [*ROOM, BOX]))
    assert len(sight.unmapped) > 3
    assert np.abs(sight.unmapped - [1.85, 2.0]).max() < 0.25


def test_box_that_went_away_is_forgotten_once_its_place_is_seen_free() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    look(sight, robot)
    robot.boxes, robot.time = ROOM, 0.2
    look(sight, robot)
    assert len(sight.unmapped) == 0


def test_box_that_is_hidden_for_a_while_stays_remembered() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    look(sight, robot)
    robot.boxes, robot.time = [*ROOM, Box(1.6, 2.0, 0.1, 0.6), BOX], 0.2
    look(sight, robot)
    assert sight.unmapped[:, 0].max() > 1.8


def test_box_behind_beams_that_get_lost_stays_remembered_for_a_while() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    look(sight, robot)
    marks = len(sight.unmapped)
    nothing = np.full(360, np.inf)
    for turn in range(1, 3):
        sight.absorb(0.2 * turn, POSE, Twist2D(), Scan(0.2 * turn, nothing), PLANNER)
    assert len(sight.unmapped) == marks
    sight.absorb(0.6, POSE, Twist2D(), Scan(0.6, nothing), PLANNER)
    assert len(sight.unmapped) == 0


def test_old_scan_is_placed_where_the_robot_was_when_it_was_taken() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    scan = robot.scan()
    for _ in range(4):
        sight.absorb(robot.time, robot.pose, robot.twist, None, PLANNER)
        robot.drive(0.2, 0.4)
    sight.absorb(robot.time, robot.pose, robot.twist, scan, PLANNER)
    assert len(sight.unmapped) > 3
    assert np.abs(sight.unmapped - [1.85, 2.0]).max() < 0.25
    assert sight.obstacles[:, 0].min() == pytest.approx(0.0, abs=0.06)


def test_what_was_seen_follows_when_the_pose_in_the_map_jumps() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    look(sight, robot)
    obstacles, unmapped = sight.obstacles, sight.unmapped
    jump = Pose2D(0.04, -0.03, 0.02)
    jumped = jump.compose(robot.pose)
    sight.absorb(0.05, jumped, Twist2D(), robot.scan(), PLANNER)
    assert np.allclose(jumped.inward(sight.obstacles), robot.pose.inward(obstacles))
    assert np.allclose(jumped.inward(sight.unmapped), robot.pose.inward(unmapped))


def test_motion_is_no_jump() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    for _ in range(60):
        look(sight, robot)
        robot.drive(0.26, 0.5)
    assert sight.track.jumps == 0
    assert sight.track.correction == Pose2D(0.0, 0.0, 0.0)


def test_obstacles_that_a_new_map_has_are_no_longer_unmapped_and_the_others_stay() -> None:
    other = Box(1.0, 3.0, 0.2, 0.2)
    sight = Sight()
    look(sight, Robot(POSE, [*ROOM, BOX, other]))
    assert (sight.unmapped[:, 1] < 2.5).any()
    sight.reconsider(GridPlanner(rasterise([*ROOM, BOX], (84, 84), (-0.1, -0.1))))
    assert len(sight.unmapped) > 2
    assert (sight.unmapped[:, 1] > 2.5).all()


def walk(sight: Sight, robot: Robot, seconds: float) -> None:
    """Let a person walk along y = 2 towards the robot, who hides with each step where it was."""
    for number in range(int(seconds / 0.2)):
        robot.boxes, robot.time = [*ROOM, Box(3.5 - 0.1 * number, 2.0, 0.3, 0.3)], robot.time + 0.2
        look(sight, robot)


def test_trail_of_what_moved_in_its_own_shadow_is_soon_forgotten() -> None:
    sight, robot = Sight(least_memory=1.0), Robot(Pose2D(0.5, 2.0, 0.0), ROOM)
    walk(sight, robot, 4.0)
    assert sight.unmapped[:, 0].max() < 2.5  # it is at 1.6 m
    assert sight.unmapped[:, 0].min() < 1.5


def test_with_the_usual_memory_the_trail_stays() -> None:
    sight, robot = Sight(), Robot(Pose2D(0.5, 2.0, 0.0), ROOM)
    walk(sight, robot, 4.0)
    assert sight.unmapped[:, 0].max() > 3.0


def test_something_that_stood_is_remembered_ten_times_as_long_as_it_was_seen() -> None:
    sight, robot = Sight(least_memory=1.0), Robot(POSE, [*ROOM, BOX])
    for _ in range(6):
        look(sight, robot)
        robot.time += 0.2
    robot.boxes = [*ROOM, Box(1.6, 2.0, 0.1, 0.6), BOX]
    for seconds, there in ((9.8, True), (10.4, False)):
        robot.time = 1.0 + seconds
        look(sight, robot)
        assert bool((sight.unmapped[:, 0] > 1.75).any()) is there


def test_something_further_away_than_the_range_is_an_obstacle_but_not_remembered() -> None:
    long, short = Sight(obstacle_max_range=1.0), Sight(obstacle_max_range=0.8)
    for sight in (long, short):
        look(sight, Robot(POSE, [*ROOM, BOX]))
        assert np.hypot(*(sight.obstacles - POSE.position).T).min() == pytest.approx(0.85, abs=0.05)
    assert len(long.unmapped) > 3
    assert len(short.unmapped) == 0
