"""A robot stops when its last scan is older than its scan timeout, which suits the rate of its sensor."""

from __future__ import annotations

import pytest

from regraft import Component
from regraft.bus_schema.messages.nav2.motions import DriveStraight, MotionDone
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.servers.behaviour_server import BehaviourServer
from regraft.testing import Rig

from ..navigator.stage import Stage
from .bench import START

USUAL, LONG = 0.6, 2.5


@pytest.mark.parametrize(("parameters", "longest"), [({}, USUAL), ({"scan_timeout": LONG}, LONG)])
@pytest.mark.parametrize("kind", [Navigator, BehaviourServer])
def test_the_robot_drives_on_for_that_long_after_the_last_scan(
    kind: type[Component], parameters: dict[str, float], longest: float
) -> None:
    with Rig() as rig:
        stage = Stage.of(rig, kind, START, parameters=parameters)
        if kind is Navigator:
            stage.send(3.4, 2.0)
        else:
            rig.goal("drive_on_heading", DriveStraight(2.5, 0.2, 60.0), MotionDone)
        stage.run(2.0)
        stage.scans = False
        stage.run(longest - 0.3)
        assert stage.robot.twist.v > 0.1
        stage.run(0.6)
        assert stage.robot.twist.v == 0.0
        stage.scans = True
        stage.run(2.0)
        assert stage.robot.twist.v > 0.1


@pytest.mark.parametrize("every", [0.4, 1.0])
def test_new_goals_do_not_make_a_robot_drive_on_with_a_silent_lidar(every: float) -> None:
    with Rig() as rig:
        stage = Stage.of(rig, BehaviourServer, START)
        rig.goal("drive_on_heading", DriveStraight(2.5, 0.2, 60.0), MotionDone)
        stage.run(2.0)
        stage.scans = False
        stage.run(USUAL + 0.3)
        stood_at = stage.robot.pose
        for _ in range(8):
            rig.goal("drive_on_heading", DriveStraight(2.5, 0.2, 60.0), MotionDone)
            stage.run(every)
        assert stage.robot.pose == stood_at


def test_it_can_change_while_the_robot_drives() -> None:
    with Rig() as rig:
        stage = Stage.of(rig, BehaviourServer, START)
        rig.goal("drive_on_heading", DriveStraight(2.5, 0.2, 60.0), MotionDone)
        stage.run(2.0)
        rig.runtimes["navigator"].parameters.set({"scan_timeout": LONG})
        stage.scans = False
        stage.run(2.0)
        assert stage.robot.twist.v > 0.1
