"""What the robot's memory of obstacles promises."""

import numpy as np
import pytest

from services.navigator.geometry import Pose
from services.navigator.planner import GridPlanner
from services.navigator.sight import Sight

from .world import Box, Robot, rasterise

ROOM = [
    Box(2.0, -0.05, 4.0, 0.1),
    Box(2.0, 4.05, 4.0, 0.1),
    Box(-0.05, 2.0, 0.1, 4.0),
    Box(4.05, 2.0, 0.1, 4.0),
]
PLANNER = GridPlanner(rasterise(ROOM, (84, 84), (-0.1, -0.1)))
POSE = Pose(1.0, 2.0, 0.3)
BOX = Box(2.0, 2.0, 0.3, 0.3)


def look(sight: Sight, robot: Robot, pose: Pose | None = None) -> None:
    """Let the robot look around at its time."""
    sight.absorb(robot.time, pose or robot.pose, robot.scan(), PLANNER)


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


def test_old_scan_is_placed_where_the_robot_was_when_it_was_taken() -> None:
    sight, robot = Sight(), Robot(POSE, [*ROOM, BOX])
    scan = robot.scan()
    sight.absorb(0.0, POSE, None, PLANNER)
    sight.absorb(0.1, Pose(1.1, 2.0, 0.8), None, PLANNER)
    sight.absorb(0.2, Pose(1.2, 2.0, 1.3), scan, PLANNER)
    assert len(sight.unmapped) > 3
    assert np.abs(sight.unmapped - [1.85, 2.0]).max() < 0.25
    assert sight.obstacles[:, 0].min() == pytest.approx(0.0, abs=0.06)
