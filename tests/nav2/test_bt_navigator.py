"""Whole drives as actions, each by one of Nav2's trees."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.messages.nav2.navigate import (
    Navigated,
    NavigateError,
    NavigateThroughPoses,
    NavigateToPose,
    NavigationFeedback,
    WaypointState,
)
from regraft.bus_schema.messages.nav2.paths import PlanError
from regraft.component.goal import Goal
from regraft.services.bt_executor.navigation.bt_navigator import BtNavigator
from regraft.testing import Rig

from ..services.rigs import set_parameters
from .bench import TREES, Bench, add, framed

DEFAULT = "navigate_to_pose_w_replanning_and_recovery.xml"
THROUGH = "navigate_through_poses_w_replanning_and_recovery.xml"


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """Return a robot with a navigator that has Nav2's trees."""
    trees = tmp_path / "trees"
    shutil.copytree(TREES, trees)
    (tmp_path / "outside.xml").write_text((TREES / DEFAULT).read_text())
    (trees / "broken.xml").write_text("<root BTCPP_format='4'><BehaviorTree ID='B'><Fly/></BehaviorTree></root>")
    with Rig() as rig:
        bench = Bench.of(rig)
        names = {"to_pose_tree": str(trees / DEFAULT), "through_poses_tree": str(trees / THROUGH)}
        add(rig, BtNavigator, "bt_navigator", **names)
        yield bench


def test_a_pose_is_driven_to_with_feedback(bench: Bench) -> None:
    goal = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated, NavigationFeedback)
    bench.run(3.0)
    first = goal.feedback
    bench.run(3.0)
    later = goal.feedback
    assert first is not None
    assert later is not None
    assert later.distance_remaining < first.distance_remaining - 0.5
    assert later.navigation_time > first.navigation_time + 2.0
    assert bench.finish(goal) == Navigated()
    assert bench.is_at(3.4, 2.0)


def test_the_tree_of_goals_that_name_none_can_be_changed_between_two_goals(bench: Bench) -> None:
    set_parameters(bench.rig, "bt_navigator", behavior_tree="broken.xml")
    done = bench.do("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
    assert done.error_code == NavigateError.BAD_TREE
    named = NavigateToPose(framed(1.4, 3.0), behavior_tree=DEFAULT)
    assert bench.do("navigate_to_pose", named, Navigated).error_code == 0
    set_parameters(bench.rig, "bt_navigator", behavior_tree="navigate_w_replanning_time.xml")
    assert bench.do("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated).error_code == 0


def test_poses_are_passed_and_all_count_as_completed(bench: Bench) -> None:
    poses = (framed(1.4, 3.0), framed(3.4, 2.0))
    done = bench.do("navigate_through_poses", NavigateThroughPoses(poses), Navigated)
    assert done.error_code == 0
    assert [each.status for each in done.waypoint_statuses] == [WaypointState.COMPLETED] * 2
    assert [each.pose for each in done.waypoint_statuses] == list(poses)
    assert bench.is_at(3.4, 2.0)


def test_a_newer_goal_is_taken_over_by_the_tree_that_runs(bench: Bench) -> None:
    first = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
    bench.run(4.0)
    second = bench.ask("navigate_to_pose", NavigateToPose(framed(3.0, 1.4)), Navigated)
    slowest = 1.0
    for _ in range(30):
        bench.run(0.05)
        slowest = min(slowest, bench.stage.robot.twist.v)
    assert slowest > 0.05, "the robot does not stop in between"
    assert first.error is not None
    assert bench.finish(second).error_code == 0
    assert bench.is_at(3.0, 1.4)


def test_a_cancelled_goal_stops_the_robot(bench: Bench) -> None:
    goal = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
    bench.run(3.0)
    goal.cancel()
    bench.run(0.5)
    assert bench.stage.robot.twist.v == 0.0
    before = bench.pose
    bench.run(2.0)
    assert bench.pose == before


def test_a_goal_outside_of_the_map_fails_with_the_planners_code(bench: Bench) -> None:
    done = bench.do("navigate_to_pose", NavigateToPose(framed(9.0, 9.0)), Navigated)
    assert done.error_code == PlanError.GOAL_OUTSIDE_MAP
    assert "outside the map" in done.error_msg


def test_another_tree_of_the_folder_can_be_chosen(bench: Bench) -> None:
    goal = NavigateToPose(framed(3.4, 2.0), "navigate_w_replanning_time.xml")
    assert bench.do("navigate_to_pose", goal, Navigated) == Navigated()
    assert bench.is_at(3.4, 2.0)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("../outside.xml", "must be a file in the folder"),
        ("/etc/passwd", "must be a file in the folder"),
        ("none.xml", "none.xml"),
        ("broken.xml", "unknown node type 'Fly'"),
    ],
)
def test_a_tree_that_cannot_be_loaded_is_reported(bench: Bench, name: str, why: str) -> None:
    done = bench.do("navigate_to_pose", NavigateToPose(framed(3.4, 2.0), name), Navigated)
    assert done.error_code == NavigateError.BAD_TREE
    assert why in done.error_msg


def test_a_goal_without_odometry_fails_in_time() -> None:
    with Rig() as rig:
        add(rig, BtNavigator, "bt_navigator", to_pose_tree=str(TREES / DEFAULT), ready_within=1.0)
        goal: Goal[Navigated, Any] = rig.goal("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
        rig.advance(1.2)
        assert goal.result is not None
        assert goal.result.error_code == NavigateError.NO_POSE


def test_no_poses_are_refused(bench: Bench) -> None:
    goal = bench.ask("navigate_through_poses", NavigateThroughPoses(()), Navigated)
    bench.run(0.2)
    assert isinstance(goal.error, CallFailed)
    assert (goal.error.code, goal.error.field) == (RefusalCode.INVALID, "poses")


def test_a_mission_leaves_drives_to_the_navigator(bench: Bench) -> None:
    bench.mission(
        """<root BTCPP_format="4"><BehaviorTree ID="M"><Sequence>
        <NavigateToPose goal="1.4;3.0;0.0" error_code_id="{code}"/>
        <Inverter><NavigateToPose goal="9;9" error_code_id="{code}" error_msg="{text}"/></Inverter>
        <NavigateThroughPoses goals="{places}"/></Sequence></BehaviorTree></root>""",
        places=[[1.4, 2.4], [2.0, 2.0, 0.0]],
    )
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.value("code") == PlanError.GOAL_OUTSIDE_MAP
    assert "outside the map" in bench.value("text")
    assert bench.is_at(2.0, 2.0)


def test_recoveries_are_counted(bench: Bench) -> None:
    bench.stage.motors = False
    goal = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated, NavigationFeedback)
    bench.run(25.0)
    assert goal.feedback is not None
    assert goal.feedback.recoveries >= 2
