"""A lidar that sees all around is blind only where a good one would see more."""

from __future__ import annotations

import math

import numpy as np
import pytest

from regraft.planar import Pose2D
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.follower import Follower
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.sensing.scan import Scan
from regraft.services.navigator.sensing.senses import ScanFault, ScanWatch

from .world import Box, Robot, rasterise

HALL = [Box(7.0, -0.05, 14.0, 0.1), Box(7.0, 14.05, 14.0, 0.1), Box(-0.05, 7.0, 0.1, 14.0), Box(14.05, 7.0, 0.1, 14.0)]
POST = Box(8.0, 7.9, 0.2, 0.2)
SIZE, ORIGIN = (284, 284), (-0.1, -0.1)
PLANNER = GridPlanner(rasterise([*HALL, POST], SIZE, ORIGIN))
MIDDLE = Pose2D(7.0, 7.0, 0.0)


def fault(pose: Pose2D, scan: Scan) -> ScanFault | None:
    """Return what is wrong with the first scan from a pose."""
    watch = ScanWatch()
    watch.look(pose, scan, pose, PLANNER)
    watch.check(scan.stamp)
    return watch.fault


def test_a_lidar_in_a_wide_hall_is_not_blind_next_to_a_post() -> None:
    scan = Robot(MIDDLE, [*HALL, POST]).scan()
    assert 0.0 < scan.echoes().mean() < 0.1
    assert fault(MIDDLE, scan) is None


@pytest.mark.parametrize("beams", [36, 360, 3600])
@pytest.mark.parametrize("place", [(0.4, 7.0), (1.5, 1.5), (12.5, 7.0)])
def test_a_lidar_that_sees_nothing_beside_walls_is_blind(beams: int, place: tuple[float, float]) -> None:
    scan = Scan(1.0, np.full(beams, math.inf), angle_increment=math.tau / beams)
    assert scan.all_around
    assert fault(Pose2D(*place, 0.5), scan) is ScanFault.BLIND


def test_a_robot_drives_past_a_post_in_a_wide_hall() -> None:
    robot = Robot(MIDDLE, [*HALL, POST])
    follower = Follower(PLANNER, Limits())
    follower.start(Pose2D(8.0, 7.0, 0.0))
    for _ in range(400):
        command = follower.update(robot.time, robot.pose, robot.twist, robot.scan())
        assert command.faults == ()
        if command.done:
            break
        robot.drive(command.v, command.w)
    assert command.done
