"""A motion that another action's motion replaces was not done: it fails with its code for an unknown error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.messages.nav2.motions import AssistedTeleop, DriveStraight, MotionDone, Spin, Wait
from regraft.bus_schema.messages.nav2.paths import FollowError, FollowPath, PathFollowed
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo
from regraft.services.bt_executor.navigation.bt_navigator import BtNavigator
from regraft.testing import Rig

from ..executor.helpers import tree
from .bench import TREES, Bench, add, framed

PLAN = '<ComputePathToPose goal="3.4;2.0;0.0" path="{path}"/>'


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


@pytest.mark.parametrize(
    ("action", "goal", "code"),
    [
        ("spin", Spin(6.0), 700),
        ("backup", DriveStraight(0.3, 0.02), 710),
        ("drive_on_heading", DriveStraight(2.0, 0.1), 720),
        ("assisted_teleop", AssistedTeleop(9.0), 730),
        ("wait", Wait(9.0), 740),
    ],
)
def test_a_replaced_motion_fails_with_its_unknown_code(bench: Bench, action: str, goal: Any, code: int) -> None:
    given = bench.ask(action, goal, MotionDone)
    bench.run(1.0)
    other, motion = ("wait", Wait(0.5)) if action == "spin" else ("spin", Spin(0.2))
    assert bench.do(other, motion, MotionDone).error_code == 0
    done = bench.finish(given, within=1.0)
    assert (done.error_code, done.cancelled) == (code, True)


def test_a_replaced_path_fails_with_the_unknown_code(bench: Bench) -> None:
    given = bench.ask("follow_path", FollowPath(bench.plan(3.4, 2.0).path), PathFollowed)
    bench.run(2.0)
    assert bench.do("spin", Spin(0.5), MotionDone).error_code == 0
    done = bench.finish(given, within=1.0)
    assert (done.error_code, done.cancelled) == (FollowError.UNKNOWN, True)


def test_a_mission_does_not_take_a_replaced_path_for_one_that_was_followed(bench: Bench) -> None:
    bench.mission(tree(PLAN, '<FollowPath path="{path}" error_code_id="{code}"/>'))
    bench.run(2.0)
    bench.do("spin", Spin(0.5), MotionDone)
    assert bench.ended(1.0) is MissionState.FAILED
    assert bench.value("code") == FollowError.UNKNOWN


def test_a_path_that_was_given_up_fails_also_where_another_one_has_come_meanwhile(bench: Bench) -> None:
    cut = '<TruncatePathLocal input_path="{path}" output_path="{cut}" pose="0.6;2;0" distance_forward="{reach}"/>'
    other = f'<Script code="reach := 4.0 - reach"/>{cut}<FollowPath path="{{cut}}" error_code_id="{{code}}"/>'
    bench.stage.motors = False
    bench.mission(tree('<Script code="reach := 1.5"/>', PLAN, f"<ReactiveSequence>{other}</ReactiveSequence>"))
    assert bench.ended(15.0) is MissionState.FAILED
    assert bench.value("code") == FollowError.FAILED_TO_MAKE_PROGRESS


def test_a_replaced_drive_is_not_an_arrival(bench: Bench) -> None:
    add(bench.rig, BtNavigator, "bt_navigator", to_pose_tree=str(TREES / "navigate_w_replanning_time.xml"))
    goal = bench.ask("navigate_to", NavigateTo(framed(3.4, 2.0)), Arrival)
    bench.run(3.0)
    bench.do("spin", Spin(0.5), MotionDone)
    assert not bench.finish(goal, within=2.0).arrived
    assert not bench.is_at(3.4, 2.0, 1.0)
