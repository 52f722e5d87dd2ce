"""Whole drives as actions, each by one of Nav2's trees."""

from __future__ import annotations

import itertools
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from behavior_tree import Blackboard, BlackboardError
from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.geometry import StampedPose
from regraft.bus_schema.messages.maps import Goals, NamedGoal
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
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargerState
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.goal import Goal
from regraft.runtime.core.clock import SteppedClock
from regraft.services.bt_executor.navigation.bt_navigator import FOREVER, BtNavigator
from regraft.services.charging.docking import Docking
from regraft.stack import StackError, check_with_classes, load
from regraft.testing import Rig
from tests.support.paths import FROG

from ..services.rigs import set_parameters
from .bench import TREES, Bench, add, framed

pytestmark = pytest.mark.slow

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


@pytest.mark.parametrize("moved", [0, 1000], ids=["simulated", "real"])
def test_a_newer_goal_is_taken_over_by_the_tree_that_runs(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, moved: int
) -> None:
    """A real clock has moved on by each look at it."""
    looks, now = itertools.count(), SteppedClock.now
    monkeypatch.setattr(SteppedClock, "now", lambda clock: now(clock) + moved * next(looks))
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


def updating(tmp_path: Path, ports: str, plan: str) -> str:
    """Return a tree that puts the goals that its topics bring into the entries that it was given."""
    planning = f'<RateController hz="2.0"><GoalUpdater {ports}>{plan}</GoalUpdater></RateController>'
    body = f'<PipelineSequence>{planning}<FollowPath path="{{path}}"/></PipelineSequence>'
    tree = f'<root BTCPP_format="4"><BehaviorTree ID="Updating">{body}</BehaviorTree></root>'
    (tmp_path / "trees" / "updating.xml").write_text(tree)
    return "updating.xml"


def test_a_newer_goal_is_taken_over_also_where_an_update_has_changed_the_entrys_type(
    bench: Bench, tmp_path: Path
) -> None:
    plan = '<ComputePathToPose goal="{goal}" path="{path}"/>'
    tree = updating(tmp_path, 'input_goal="{goal}" output_goal="{goal}"', plan)
    bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0), tree), Navigated)
    bench.run(2.0)
    bench.rig.publish("goal_update", StampedPose(1.0, "map", framed(3.4, 2.6).pose))
    bench.run(2.0)
    assert bench.do("navigate_to_pose", NavigateToPose(framed(3.0, 1.4), tree), Navigated) == Navigated()
    assert bench.is_at(3.4, 2.6), "the update holds: it has a stamp, and the goal has none"


def test_goals_that_an_update_has_replaced_are_driven_through_with_feedback(bench: Bench, tmp_path: Path) -> None:
    plan = '<ComputePathThroughPoses goals="{goals}" path="{path}"/>'
    tree = updating(tmp_path, 'input_goals="{goals}" output_goals="{goals}"', plan)
    through = NavigateThroughPoses((framed(1.4, 3.0), framed(3.4, 2.0)), tree)
    goal = bench.ask("navigate_through_poses", through, Navigated, NavigationFeedback)
    bench.run(1.0)
    bench.rig.publish("goals_update", Goals(1.0, (NamedGoal("", framed(3.4, 2.6)),)))
    bench.run(2.0)
    assert goal.feedback is not None
    assert goal.feedback.poses_remaining == 1
    assert bench.finish(goal).error_code == 0
    assert bench.is_at(3.4, 2.6)


@pytest.mark.parametrize(
    ("action", "goal", "result"),
    [
        ("navigate_through_poses", NavigateThroughPoses((framed(1.4, 3.0),)), Navigated),
        ("navigate_to", NavigateTo(framed(1.4, 3.0)), Arrival),
    ],
)
def test_while_one_action_drives_another_one_is_refused(
    bench: Bench, action: str, goal: object, result: type[Any]
) -> None:
    first = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
    bench.run(2.0)
    second = bench.ask(action, goal, result)
    bench.run(0.2)
    assert isinstance(second.error, CallFailed)
    assert second.error.code is RefusalCode.BUSY
    assert "navigate_to_pose drives the robot" in second.error.why
    assert bench.finish(first) == Navigated()
    assert bench.is_at(3.4, 2.0)
    bench.do(action, goal, result)
    assert bench.is_at(1.4, 3.0)


def test_another_action_drives_once_a_goal_was_cancelled_or_could_not_be_pursued(bench: Bench) -> None:
    bench.do("navigate_to_pose", NavigateToPose(framed(3.4, 2.0), "broken.xml"), Navigated)
    first = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
    bench.run(2.0)
    first.cancel()
    assert bench.do("navigate_to", NavigateTo(framed(1.4, 3.0)), Arrival).arrived
    assert bench.is_at(1.4, 3.0)


def test_an_unforeseen_error_stops_the_robot(bench: Bench, tmp_path: Path) -> None:
    before, within, behind = (TREES / DEFAULT).read_text().partition("<RecoveryNode")
    within, end, behind = f"{within}{behind}".rpartition("</RecoveryNode>")
    tree = f'{before}<Sequence><Script code="goals := 5"/>{within}{end}</Sequence>{behind}'
    (tmp_path / "trees" / "odd.xml").write_text(tree)
    goal = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0), behavior_tree="odd.xml"), Navigated)
    bench.run(3.0)
    assert "is no list of goals" in str(goal.error)
    assert bench.stage.robot.twist.v == 0.0
    assert "is no list of goals" in bench.rig.take_faults()[0]


def test_a_newer_goal_that_fails_to_take_the_tree_over_stops_the_robot(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0)), Navigated)
    bench.run(3.0)
    assert bench.stage.robot.twist.v > 0.0

    def refuse(board: Blackboard, key: str, value: object, kind: object = None) -> None:
        raise BlackboardError(f"'{key}' cannot be written")

    with monkeypatch.context() as patched:
        patched.setattr(Blackboard, "set", refuse)
        second = bench.ask("navigate_to_pose", NavigateToPose(framed(3.0, 1.4)), Navigated)
        assert bench.run_until(lambda: first.done and second.done, 1.0)
    assert "cannot be written" in str(second.error)
    bench.run(1.0)
    assert bench.stage.robot.twist.v == 0.0
    assert len(bench.rig.take_faults()) == 1


@pytest.fixture
def sulking(tmp_path: Path) -> str:
    """Return a tree whose FollowPath has a script that fails when it is halted."""
    text = (TREES / "navigate_w_replanning_time.xml").read_text()
    (tmp_path / "trees" / "sulking.xml").write_text(text.replace("<FollowPath", '<FollowPath _onHalted="missing += 1"'))
    return "sulking.xml"


def halts_that_failed(bench: Bench) -> list[str]:
    return [event.text for event in bench.rig.events if event.kind == "navigation.halt_failed"]


def test_a_tree_that_fails_to_halt_keeps_no_navigator_from_its_deactivation(bench: Bench, sulking: str) -> None:
    bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0), sulking), Navigated)
    bench.run(3.0)
    bench.rig.transition("bt_navigator", Transition.DEACTIVATE)
    assert bench.rig.state("bt_navigator") is State.INACTIVE
    bench.run(0.5)
    assert bench.stage.robot.twist.v == 0.0
    (event,) = halts_that_failed(bench)
    assert "'missing'" in event


def test_a_tree_that_fails_to_halt_keeps_no_newer_goal_from_its_drive(bench: Bench, sulking: str) -> None:
    first = bench.ask("navigate_to_pose", NavigateToPose(framed(3.4, 2.0), sulking), Navigated)
    bench.run(3.0)
    assert not first.done
    assert bench.do("navigate_to_pose", NavigateToPose(framed(1.4, 3.0)), Navigated) == Navigated()
    assert bench.is_at(1.4, 3.0)
    assert len(halts_that_failed(bench)) == 1


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


def test_clients_of_a_plain_navigator_are_served_by_the_tree_too(bench: Bench) -> None:
    goal = bench.ask("navigate_to", NavigateTo(framed(3.4, 2.0)), Arrival, NavigationProgress)
    bench.run(4.0)
    first = goal.feedback
    bench.run(3.0)
    later = goal.feedback
    assert first is not None
    assert later is not None
    assert 0.0 < later.distance_left < first.distance_left - 0.4
    assert 0.0 < later.time_left < first.time_left < FOREVER
    assert (later.phase, later.recoveries) == ("driving", 0)
    arrival = bench.finish(goal)
    assert (arrival.arrived, arrival.reason) == (True, "")
    assert (arrival.pose.x, arrival.pose.y) == pytest.approx((3.4, 2.0), abs=0.2)


def test_such_a_client_hears_why_the_goal_was_not_reached(bench: Bench) -> None:
    arrival = bench.do("navigate_to", NavigateTo(framed(9.0, 9.0)), Arrival)
    assert not arrival.arrived
    assert "outside the map" in arrival.reason
    assert arrival.pose.x == pytest.approx(0.6, abs=0.05)


def check_stack(folder: Path, **trees: str) -> None:
    """Check FROG's stack with other default trees, as `regraft up` does."""
    parameters = {"to_pose_tree": "", "through_poses_tree": ""} | trees
    stack = {"include": [str(FROG / "nav2.yaml")], "components": {"bt_navigator": {"parameters": parameters}}}
    file = folder / "stack.yaml"
    file.write_text(json.dumps(stack))
    check_with_classes(load(file))


def test_a_stack_whose_navigator_has_no_tree_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StackError, match=r"bt_navigator\.parameters\.to_pose_tree"):
        check_stack(tmp_path)
    check_stack(tmp_path, to_pose_tree=str(TREES / DEFAULT))
    check_stack(tmp_path, through_poses_tree=str(TREES / THROUGH))


def test_such_a_goal_without_odometry_is_refused() -> None:
    with Rig() as rig:
        add(rig, BtNavigator, "bt_navigator", to_pose_tree=str(TREES / DEFAULT), ready_within=1.0)
        goal: Goal[Arrival, Any] = rig.goal("navigate_to", NavigateTo(framed(3.4, 2.0)), Arrival)
        rig.advance(1.2)
        assert isinstance(goal.error, CallFailed)
        assert goal.error.code == RefusalCode.UNAVAILABLE


def test_a_robot_docks_by_a_tree(bench: Bench) -> None:
    add(bench.rig, Docking, "docking", dock_x=2.0, dock_y=2.0)
    goal = bench.ask("charge", Charge(0.9), Charged)
    charging = False
    for _ in range(60):
        docked = bench.is_at(2.0, 2.0)
        now = bench.rig.clock.now() / 1e9
        bench.rig.publish("battery", BatteryState(now, 100.0, 100.0, 0.95 if docked and charging else 0.5, 5.0))
        bench.rig.publish("charger", ChargerState(now, docked, 20.0))
        bench.run(0.5)
        charging = docked
        if goal.done:
            break
    assert goal.result == Charged(True, 0.95)
