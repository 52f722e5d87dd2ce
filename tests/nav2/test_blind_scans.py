"""A scan is judged before it is believed: a blind one proves nothing, the first good one counts at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from regraft.bus_schema.messages.nav2.motions import DriveStraight, MotionDone
from regraft.bus_schema.messages.nav2.paths import Path, PathValidity, PlanarPose, ValidatePath
from regraft.testing import Rig

from ..navigator.world import Box
from .bench import Bench

CHAIR = Box(2.0, 2.0, 0.4, 0.4)
CLOSE = Box(0.78, 2.0, 0.1, 0.6)
"""It leaves a few centimetres in front of the robot's outline."""
LINE = Path(0.0, "map", tuple(PlanarPose(0.6 + 0.05 * step, 2.0) for step in range(57)))
ON = DriveStraight(2.0, 0.2, 60.0)


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


def test_a_motion_that_begins_blind_makes_no_step_towards_what_the_first_good_scan_shows(bench: Bench) -> None:
    bench.stage.lost_beams = 1.0
    bench.run(1.0)
    goal = bench.ask("drive_on_heading", ON, MotionDone)
    bench.run(1.0)
    bench.surprise(CLOSE)
    bench.stage.lost_beams = 0.0
    assert bench.finish(goal, within=5.0).error_code == 723
    assert max(twist.forward for twist in bench.stage.commands) == 0.0


def test_what_left_while_the_robot_had_nothing_to_do_is_in_no_ones_way(bench: Bench) -> None:
    goal = bench.ask("drive_on_heading", DriveStraight(2.0, 0.1, 60.0), MotionDone)
    bench.run(1.0)
    bench.surprise(Box(bench.pose.x + 0.5, 2.0, 0.1, 0.6))
    bench.run(0.4)
    bench.stage.scans = False
    bench.run(0.7)
    assert not goal.done
    goal.cancel()
    bench.run(0.2)
    bench.clear_away()
    bench.stage.scans = True
    bench.run(1.0)
    assert bench.do("drive_on_heading", DriveStraight(0.8, 0.2), MotionDone).error_code == 0


def test_blind_scans_make_a_planner_forget_nothing(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    assert not bench.rig.call("is_path_valid", ValidatePath(LINE), PathValidity).is_valid
    bench.stage.lost_beams = 1.0
    bench.run(3.0)
    assert not bench.rig.call("is_path_valid", ValidatePath(LINE), PathValidity).is_valid
    assert np.abs(bench.plan(3.4, 2.0).path.rows[:, 1] - 2.0).max() > 0.3


def test_a_planner_takes_in_what_has_changed_once_its_lidar_sees_again(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    bench.stage.lost_beams = 1.0
    bench.run(3.0)
    bench.clear_away()
    bench.stage.lost_beams = 0.0
    bench.run(1.0)
    assert bench.rig.call("is_path_valid", ValidatePath(LINE), PathValidity).is_valid
