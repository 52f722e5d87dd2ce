"""Nav2's leaves one by one: what they ask, what they write, and what they refuse."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.geometry import FramedPose, StampedPose
from regraft.bus_schema.messages.maps import Goals, NamedGoal
from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.messages.nav2.motions import Selection
from regraft.bus_schema.messages.nav2.paths import MAX_POSES, FollowError, FollowPath, PathFollowed
from regraft.bus_schema.messages.power import BatteryState, ChargerState
from regraft.bus_schema.model.lifecycle import Transition
from regraft.services.bt_executor.leaves.nav2 import NAV2_LEAVES
from regraft.services.bt_executor.leaves.nav2.poses import goals_of, pose_of
from regraft.services.navigator.servers.route_server import RouteServer
from regraft.testing import Rig

from ..executor.helpers import entry, tree
from ..navigator.world import Box
from .bench import Bench, add, framed
from .test_trees import EDGES, NODES

PLAN = '<ComputePathToPose goal="3.4;2.0;0.0" path="{path}"/>'
CHAIR = Box(2.0, 2.0, 0.4, 0.4)


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


def outcome(bench: Bench, *nodes: str, **entries: Any) -> MissionState:
    """Run some nodes in a sequence to their end."""
    bench.mission(tree(*nodes), **entries)
    return bench.ended(30.0)


SUCCEEDED, FAILED, RUNNING = MissionState.SUCCEEDED, MissionState.FAILED, MissionState.RUNNING


# --- poses ---


@pytest.mark.parametrize(
    "value",
    [
        framed(1.0, 2.0, 0.5),
        framed(1.0, 2.0, 0.5).pose,
        NamedGoal("shelf", framed(1.0, 2.0, 0.5)),
        StampedPose(3.0, "map", framed(1.0, 2.0, 0.5).pose),
        [1.0, 2.0, 0.5],
        (1, 2, 0.5),
        "1;2;0.5",
    ],
)
def test_a_pose_may_have_many_forms(value: Any) -> None:
    assert pose_of(value) == framed(1.0, 2.0, 0.5)


@pytest.mark.parametrize("value", ["here", [1.0], [1.0, 2.0, 3.0, 4.0], "nan;1", 7, {}])
def test_what_is_no_pose_is_refused(value: Any) -> None:
    with pytest.raises(ValueError, match="is no pose; it must hold a goal, a pose, or numbers"):
        pose_of(value)


def test_goals_may_be_a_message_or_a_list() -> None:
    named = NamedGoal("shelf", framed(1.0, 2.0))
    assert goals_of(Goals(0.0, (named,))) == [named]
    assert goals_of([[1.0, 2.0]]) == [[1.0, 2.0]]
    assert goals_of(None) == []
    with pytest.raises(ValueError, match="is no list of goals"):
        goals_of("north")


# --- asking ---


def test_a_refused_goal_and_a_server_that_is_not_there_have_nav2s_codes(bench: Bench) -> None:
    spin = '<Inverter><Spin {0} server_timeout="500" error_code_id="{{code}}" error_msg="{{text}}"/></Inverter>'
    assert outcome(bench, spin.format('server_name="twirl"')) is SUCCEEDED
    assert bench.value("code") == 2
    assert "twirl" in bench.value("text")
    bench.rig.transition("navigator", Transition.DEACTIVATE)
    assert outcome(bench, spin.format("")) is SUCCEEDED
    assert bench.value("code") == 1
    assert "not active" in bench.value("text") or "inactive" in bench.value("text")


def test_an_error_code_stays_readable_and_is_0_after_a_success(bench: Bench) -> None:
    failing = '<ComputePathToPose goal="9;9" path="{path}" error_code_id="{code}" error_msg="{text}"/>'
    assert (
        outcome(bench, f"<Inverter>{failing}</Inverter>", '<WouldAPlannerRecoveryHelp error_code="{code}"/>') is FAILED
    )
    assert bench.value("code") == 204
    assert outcome(bench, PLAN.replace("/>", ' error_code_id="{code}"/>')) is SUCCEEDED
    assert bench.value("code") == 0


def test_a_missing_port_is_reported_when_the_tree_is_loaded(bench: Bench) -> None:
    for leaf, port in (("ComputePathToPose", "goal"), ("FollowPath", "path"), ("NavigateToPose", "goal")):
        with pytest.raises(CallFailed, match=f"{leaf} needs the port {port}"):
            bench.mission(tree(f"<{leaf}/>"))


def test_a_halted_leaf_cancels_its_goal(bench: Bench) -> None:
    bench.mission(tree('<Timeout msec="1000"><DriveOnHeading dist_to_travel="2.0" speed="0.2"/></Timeout>'))
    assert bench.ended() is FAILED
    bench.run(0.3)
    assert bench.stage.robot.twist.v == 0.0
    assert bench.pose.x < 0.9


def test_a_cancelled_motion_is_a_success(bench: Bench) -> None:
    for leaf, cancel in (
        ('<Spin spin_dist="6.0"/>', "CancelSpin"),
        ('<BackUp backup_dist="0.3" backup_speed="0.02"/>', "CancelBackUp"),
        ('<DriveOnHeading dist_to_travel="2.0" speed="0.1"/>', "CancelDriveOnHeading"),
        ('<Wait wait_duration="9.0"/>', "CancelWait"),
        ('<AssistedTeleop time_allowance="9.0"/>', "CancelAssistedTeleop"),
    ):
        started = bench.stage.robot.time
        body = f'<ParallelAll>{leaf}<Delay delay_msec="500"><{cancel}/></Delay></ParallelAll>'
        assert outcome(bench, body) is SUCCEEDED, cancel
        assert bench.stage.robot.time - started < 3.0, cancel


def test_cancelling_control_ends_a_path_early(bench: Bench) -> None:
    body = '<ParallelAll><FollowPath path="{path}"/><Delay delay_msec="2000"><CancelControl/></Delay></ParallelAll>'
    assert outcome(bench, PLAN, body) is SUCCEEDED
    assert bench.pose.x < 2.0


def test_a_path_that_its_server_gives_up_is_not_followed(bench: Bench) -> None:
    bench.mission(tree(PLAN, '<FollowPath path="{path}" error_code_id="{code}" error_msg="{text}"/>'))
    bench.run(2.0)
    bench.rig.transition("navigator", Transition.DEACTIVATE)
    assert bench.ended(5.0) is FAILED
    assert bench.value("code") == FollowError.UNKNOWN
    assert bench.value("text")
    assert bench.pose.x < 2.0


def test_a_path_that_another_clients_goal_replaces_is_not_followed(bench: Bench) -> None:
    bench.mission(tree(PLAN, '<FollowPath path="{path}" error_code_id="{code}"/>'))
    bench.run(2.0)
    other = FollowPath(bench.plan(1.0, 3.0).path)
    assert bench.do("follow_path", other, PathFollowed).error_code == 0
    assert bench.ended(1.0) is FAILED
    assert bench.value("code") == FollowError.UNKNOWN


# --- paths ---


def test_a_path_is_planned_smoothed_checked_and_followed(bench: Bench) -> None:
    nodes = (
        PLAN,
        '<SmoothPath unsmoothed_path="{path}" smoothed_path="{smooth}" was_completed="{done}"/>',
        '<IsPathValid path="{smooth}"/>',
        '<FollowPath path="{smooth}" tracking_feedback="{tracking}"/>',
        '<GoalReached goal="3.4;2.0"/>',
    )
    assert outcome(bench, *nodes) is SUCCEEDED
    assert bench.value("done") is True


def test_a_path_with_something_on_it_is_not_valid_and_names_the_poses(bench: Bench) -> None:
    bench.mission(tree(PLAN))
    assert bench.ended() is SUCCEEDED
    bench.surprise(CHAIR)
    bench.run(1.0)
    check = '<Inverter><ValidatePath path="{path}" collision_poses="{touched}"/></Inverter>'
    static = PLAN.replace("/>", ' planner_id="StaticGrid"/>')
    assert outcome(bench, static, check) is SUCCEEDED
    assert len(bench.value("touched")) == 1
    assert outcome(bench, static, '<ValidatePath path="{path}" layer_name="static"/>') is SUCCEEDED
    assert outcome(bench, '<ValidatePath path="{nothing}"/>') is FAILED


def test_a_path_is_cut_at_its_end(bench: Bench) -> None:
    cut = '<TruncatePath input_path="{path}" distance="1.0" output_path="{cut}"/>'
    last = '<GetPoseFromPath path="{cut}" index="-1" pose="{last}"/>'
    assert (
        outcome(bench, PLAN, cut, last, '<ArePosesNear ref_pose="{last}" target_pose="2.4;2" tolerance="0.1"/>')
        is SUCCEEDED
    )


def test_a_path_is_cut_to_what_is_near_the_robot(bench: Bench) -> None:
    cut = (
        '<TruncatePathLocal input_path="{path}" output_path="{cut}" pose="2;2;0" distance_forward="0.5"'
        ' distance_backward="0.2"/>'
    )
    first = '<GetPoseFromPath path="{cut}" pose="{first}"/>'
    last = '<GetPoseFromPath path="{cut}" index="-1" pose="{last}"/>'
    near = '<ArePosesNear ref_pose="{%s}" target_pose="%s;2" tolerance="0.06"/>'
    assert outcome(bench, PLAN, cut, first, last, near % ("first", "1.8"), near % ("last", "2.5")) is SUCCEEDED


def test_paths_are_joined(bench: Bench) -> None:
    back = '<ComputePathToPose start="3.4;2" goal="3.4;3" path="{second}"/>'
    join = '<ConcatenatePaths input_path1="{path}" input_path2="{second}" output_path="{both}"/>'
    last = '<GetPoseFromPath path="{both}" index="-1" pose="{last}"/>'
    assert outcome(bench, PLAN, back, join, last, '<ArePosesNear ref_pose="{last}" target_pose="3.4;3"/>') is SUCCEEDED
    assert outcome(bench, join) is FAILED, "two empty paths"
    assert outcome(bench, PLAN, '<GetPoseFromPath path="{path}" index="5000" pose="{last}"/>') is FAILED


def test_paths_that_are_too_long_together_are_not_joined(bench: Bench) -> None:
    join = '<ConcatenatePaths input_path1="{path}" input_path2="{path}" output_path="{path}"/>'
    doubled = f"<Inverter><KeepRunningUntilFailure>{join}</KeepRunningUntilFailure></Inverter>"
    far = f'<GetPoseFromPath path="{{path}}" index="{MAX_POSES // 2}" pose="{{last}}"/>'
    assert outcome(bench, PLAN, doubled, far) is SUCCEEDED


# --- lists of goals ---


def test_goals_that_are_passed_are_removed_but_the_last(bench: Bench) -> None:
    remove = '<RemovePassedGoals input_goals="{goals}" output_goals="{goals}" radius="1.0"/>'
    assert outcome(bench, remove, goals=[[0.5, 2.0], [1.0, 2.0], [3.0, 2.0]]) is SUCCEEDED
    assert bench.value("goals") == [[3.0, 2.0]]
    assert outcome(bench, remove, goals=[[0.5, 2.0], [0.6, 2.0]]) is SUCCEEDED
    assert bench.value("goals") == [[0.6, 2.0]]


def test_goals_in_something_are_removed(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    remove = '<RemoveInCollisionGoals input_goals="{goals}" output_goals="{goals}"/>'
    assert outcome(bench, remove, goals=[[1.85, 2.0], [3.0, 3.0]]) is SUCCEEDED
    assert bench.value("goals") == [[3.0, 3.0]]
    assert outcome(bench, '<CheckPoseOccupancy pose="1.85;2.0"/>') is SUCCEEDED
    assert outcome(bench, '<CheckPoseOccupancy pose="3.0;3.0"/>') is FAILED


def test_goals_are_appended_and_taken(bench: Bench) -> None:
    append = '<AppendGoalPoseToGoals goal_pose="{last}" input_goals="{goals}" output_goals="{goals}"/>'
    few = '<GetNextFewGoals input_goals="{goals}" num_goals="2" output_goals="{few}"/>'
    assert outcome(bench, append, few, goals=[[1.0, 1.0], [2.0, 2.0]], last=[3.0, 3.0]) is SUCCEEDED
    assert bench.value("goals") == [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]
    assert bench.value("few") == [[1.0, 1.0], [2.0, 2.0]]
    assert outcome(bench, '<GetNextFewGoals input_goals="{none}" num_goals="2" output_goals="{few}"/>') is FAILED


def test_a_route_becomes_goals(bench: Bench) -> None:
    add(bench.rig, RouteServer, "routes", nodes=NODES, edges=EDGES)
    route = '<ComputeRoute goal="3.4;2" use_poses="true" route="{route}" path="{path}" error_code_id="{code}"/>'
    assert outcome(bench, route, '<ExtractRouteNodesAsGoals route="{route}" goals="{goals}"/>') is SUCCEEDED
    assert len(bench.value("goals")) == 3
    unknown = '<Inverter><ComputeRoute goal_id="9" error_code_id="{code}" route="{route}"/></Inverter>'
    assert outcome(bench, unknown) is SUCCEEDED
    assert bench.value("code") == 403
    assert outcome(bench, unknown, '<ExtractRouteNodesAsGoals route="{route}" goals="{goals}"/>') is FAILED


@pytest.mark.parametrize(
    "leaf",
    [
        '<TakeGoal goals="{goals}" goal="{goal}" goal_name="{name}"/>',
        '<NextGoal goals="{goals}" index="{index}" goal="{goal}" goal_name="{name}"/>',
    ],
    ids=["TakeGoal", "NextGoal"],
)
def test_goals_without_a_name_are_taken_too(bench: Bench, leaf: str) -> None:
    add(bench.rig, RouteServer, "routes", nodes=NODES, edges=EDGES)
    route = '<ComputeRoute goal="3.4;2" use_poses="true" route="{route}" path="{path}"/>'
    extract = '<ExtractRouteNodesAsGoals route="{route}" goals="{goals}"/>'
    assert outcome(bench, route, extract, leaf, '<GoalReached goal="{goal}" goal_reached_tol="9.0"/>') is SUCCEEDED
    assert bench.value("name") == ""
    assert outcome(bench, leaf, goals=[[1.4, 2.0], [2.0, 2.0, 0.5]]) is SUCCEEDED
    assert (bench.value("goal"), bench.value("name")) == ([1.4, 2.0], "")


# --- the robot itself ---


def test_the_current_pose_is_written(bench: Bench) -> None:
    assert outcome(bench, '<GetCurrentPose current_pose="{here}"/>') is SUCCEEDED
    assert bench.value("here")["pose"]["position"]["x"] == pytest.approx(0.6)


def test_a_selector_takes_what_its_topic_brings_else_the_default(bench: Bench) -> None:
    select = '<ControllerSelector selected_controller="{chosen}" default_controller="FollowPath"/>'
    assert outcome(bench, select) is SUCCEEDED
    assert bench.value("chosen") == "FollowPath"
    bench.rig.publish("controller_selector", Selection("PurePursuit"))
    assert outcome(bench, select) is SUCCEEDED
    assert bench.value("chosen") == "PurePursuit"
    assert outcome(bench, '<PlannerSelector selected_planner="{planner}"/>') is FAILED, "neither topic nor default"


@pytest.mark.parametrize("subject", ["planner", "smoother", "goal_checker", "progress_checker", "path_handler"])
def test_each_selector_has_its_topic(bench: Bench, subject: str) -> None:
    name = "".join(part.title() for part in subject.split("_"))
    bench.mission(tree("<AlwaysSuccess/>"))
    bench.rig.publish(f"{subject}_selector", Selection("other"))
    assert outcome(bench, f'<{name}Selector selected_{subject}="{{chosen}}" default_{subject}="usual"/>') is SUCCEEDED
    assert bench.value("chosen") == "other"


def test_the_battery_is_low_at_the_bound_and_not_before_it_is_known(bench: Bench) -> None:
    low = '<IsBatteryLow min_battery="0.3"/>'
    assert outcome(bench, low) is FAILED
    for charge, state in ((0.5, FAILED), (0.3, SUCCEEDED), (0.1, SUCCEEDED)):
        bench.rig.publish("battery", BatteryState(0.0, charge * 100.0, 100.0, charge, 5.0))
        assert outcome(bench, low) is state
    assert outcome(bench, '<IsBatteryLow min_battery="0.3" battery_topic="/battery_status"/>') is SUCCEEDED
    with pytest.raises(CallFailed, match="'is_voltage' must be false"):
        bench.mission(tree('<IsBatteryLow min_battery="11.0" is_voltage="true"/>'))


def test_the_battery_charges_on_a_charger_that_gives_power(bench: Bench) -> None:
    charging = '<IsBatteryCharging battery_topic="/battery_status"/>'
    assert outcome(bench, charging) is FAILED
    for connected, power, state in ((False, 0.0, FAILED), (True, 0.0, FAILED), (True, 20.0, SUCCEEDED)):
        bench.rig.publish("charger", ChargerState(0.0, connected, power))
        assert outcome(bench, charging) is state


def test_transforms_are_available_between_frames_that_messages_have_shown(bench: Bench) -> None:
    for child, parent, state in (
        ("base_link", "map", SUCCEEDED),
        ("lidar", "odom", SUCCEEDED),
        ("gripper", "map", FAILED),
    ):
        assert outcome(bench, f'<TransformAvailable child="{child}" parent="{parent}"/>') is state, child
    with pytest.raises(CallFailed, match="TransformAvailable needs the port parent"):
        bench.mission(tree('<TransformAvailable child="base_link"/>'))


def test_the_initial_pose_is_received_with_the_first_odometry(bench: Bench) -> None:
    assert outcome(bench, "<InitialPoseReceived/>") is SUCCEEDED


def test_a_robot_that_is_stopped_hard_is_stuck(bench: Bench) -> None:
    stuck = '<KeepRunningUntilFailure><Inverter><IsStuck brake_limit="1.0"/></Inverter></KeepRunningUntilFailure>'
    bench.mission(
        tree(f'<ParallelAll max_failures="1"><DriveOnHeading dist_to_travel="2" speed="0.2"/>{stuck}</ParallelAll>')
    )
    bench.run(3.0)
    assert bench.ticked("IsStuck") or bench.state() is RUNNING
    bench.stage.motors = False
    bench.run(1.0)
    assert not bench.ticked("KeepRunningUntilFailure")


def test_a_robot_has_stopped_when_it_has_stood_for_a_while(bench: Bench) -> None:
    assert outcome(bench, '<CheckStopStatus duration_stopped="500"/>') is SUCCEEDED
    drive = '<DriveOnHeading dist_to_travel="1" speed="0.2"/>'
    moving = '<Delay delay_msec="1000"><Inverter><CheckStopStatus/></Inverter></Delay>'
    assert outcome(bench, f"<ParallelAll>{drive}{moving}</ParallelAll>") is SUCCEEDED


def test_costmaps_are_cleared_by_name(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    names = ("entirely", "except", "around", "around_pose")
    leaves = ("ClearEntireCostmap", "ClearCostmapExceptRegion", "ClearCostmapAroundRobot", "ClearCostmapAroundPose")
    nodes = [
        f'<{leaf} service_name="{costmap}_costmap/clear_{name}_{costmap}_costmap"{pose}/>'
        for costmap in ("global", "local")
        for leaf, name in zip(leaves, names, strict=True)
        for pose in (' pose="2;2"' if leaf.endswith("Pose") else "",)
    ]
    assert outcome(bench, *nodes) is SUCCEEDED
    assert outcome(bench, "<ClearEntireCostmap/>") is FAILED, "which costmap is not stated"


def test_waiting_for_a_condition_lasts_until_a_script_is_true(bench: Bench) -> None:
    bench.mission(tree('<WaitForCondition code="ready > 1"/>'), ready=0)
    bench.run(2.0)
    assert bench.state() is RUNNING
    bench.write(ready=2)
    assert bench.ended(1.0) is SUCCEEDED
    with pytest.raises(CallFailed, match="WaitForCondition"):
        bench.mission(tree('<WaitForCondition code="ready >"/>'))


def test_every_leaf_describes_itself_and_its_ports() -> None:
    for name, leaf in NAV2_LEAVES.items():
        assert leaf.__doc__, name


def test_the_robots_pose_is_an_entry_of_the_blackboard(bench: Bench) -> None:
    bench.mission(tree('<Sleep msec="500"/>'))
    assert bench.ended() is SUCCEEDED
    assert entry(bench.rig, "robot_speed").value == 0.0
    assert isinstance(pose_of([0.0, 0.0]), FramedPose)
