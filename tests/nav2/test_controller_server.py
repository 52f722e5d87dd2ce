"""The controller server: following paths, and single motions; each asked by itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import pytest

from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.nav2.motions import (
    AssistedTeleop,
    CancelGoals,
    DriveStraight,
    GoalsCancelled,
    MotionDone,
    MotionProgress,
    Spin,
    Wait,
)
from regraft.bus_schema.messages.nav2.paths import (
    ClearCostmap,
    CostmapCleared,
    FollowError,
    FollowPath,
    Path,
    PathFollowed,
    TrackingFeedback,
)
from regraft.component.goal import Goal
from regraft.planar import Pose2D, wrap_angle
from regraft.runtime.core.clock import SteppedClock
from regraft.services.navigator.servers.controller_server import ControllerServer
from regraft.testing import Rig

from ..navigator.stage import ROOM
from ..navigator.world import Box
from .bench import START, Bench, framed

AHEAD = Box(1.3, 2.0, 0.2, 3.0)
"""It leaves 0.5 m in front of the robot's outline."""
BEHIND = Box(0.15, 2.0, 0.1, 1.0)


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


def follow(bench: Bench, x: float, y: float, yaw: float = 0.0, **names: str) -> Goal[PathFollowed, TrackingFeedback]:
    path = bench.plan(x, y, yaw).path
    return bench.ask("follow_path", FollowPath(path, **names), PathFollowed, TrackingFeedback)


def move(bench: Bench, action: str, goal: object, within: float = 30.0) -> MotionDone:
    return bench.do(action, goal, MotionDone, within)


# --- paths ---


@pytest.mark.parametrize("controller", ["", "FollowPath", "PurePursuit"])
def test_a_path_is_followed_to_its_end_and_heading(bench: Bench, controller: str) -> None:
    assert bench.finish(follow(bench, 2.6, 2.6, 1.5, controller=controller)) == PathFollowed()
    assert bench.is_at(2.6, 2.6)
    assert abs(wrap_angle(bench.pose.yaw - 1.5)) < 0.15
    assert bench.collisions == 0


def test_how_well_it_is_followed_is_reported(bench: Bench) -> None:
    goal = follow(bench, 3.4, 2.0)
    bench.run(2.0)
    first = goal.feedback
    bench.run(3.0)
    later = goal.feedback
    assert first is not None
    assert later is not None
    assert later.remaining_path_length < first.remaining_path_length - 0.5
    assert later.current_path_index > first.current_path_index
    assert abs(later.position_tracking_error) < 0.1
    assert later.speed == pytest.approx(0.26, abs=0.02)
    assert later.robot_pose is not None


def test_the_tracking_error_is_positive_left_of_the_path_and_for_a_heading_to_its_right(bench: Bench) -> None:
    goal = follow(bench, 3.4, 2.0)
    bench.run(1.3)
    bench.stage.robot.pose = Pose2D(bench.pose.x, 2.2, -0.3)
    bench.run(0.3)
    assert goal.feedback is not None
    assert goal.feedback.position_tracking_error == pytest.approx(0.2, abs=0.05)
    assert goal.feedback.heading_tracking_error == pytest.approx(0.3, abs=0.2)


def test_safety_and_performance_are_measured_on_the_way_and_safety_alone_when_it_is_over(bench: Bench) -> None:
    measured = bench.rig.collect_qualities("navigator")
    goal = follow(bench, 3.4, 2.0)
    bench.run(4.0)
    under_way = measured[-1].values
    assert under_way["performance"] == pytest.approx(0.9, abs=0.1)
    assert 0.0 < under_way["safety"] <= 1.0
    assert under_way["clearance"] > 0.2
    bench.surprise(Box(bench.pose.x, bench.pose.y - 0.4, 0.2, 0.2))
    bench.run(1.0)
    assert measured[-1].values["safety"] < under_way["safety"]
    bench.clear_away()
    bench.finish(goal)
    bench.run(3.0)
    assert "performance" not in measured[-1].values
    assert "safety" in measured[-1].values


def test_estimates_of_driving_fall_with_the_speed_and_with_the_clearance() -> None:
    driven = [ControllerServer.estimate({"max_velocity": speed}, {"clearance": 0.3}) for speed in (0.1, 0.26)]
    assert driven[0]["performance"] < driven[1]["performance"] == 1.0
    assert driven[0]["safety"] > driven[1]["safety"]
    assert "safety" not in ControllerServer.estimate({"max_velocity": 0.1}, {})


def test_a_goal_checker_for_the_position_alone_leaves_the_heading(bench: Bench) -> None:
    assert bench.finish(follow(bench, 2.0, 2.0, 3.0, goal_checker="position_goal_checker")) == PathFollowed()
    assert abs(wrap_angle(bench.pose.yaw)) < 0.5


def test_a_stopped_goal_checker_ends_with_a_robot_that_stands(bench: Bench) -> None:
    assert bench.finish(follow(bench, 2.0, 2.0, goal_checker="stopped_goal_checker")) == PathFollowed()
    assert bench.stage.robot.twist.v == 0.0


@pytest.mark.parametrize(
    ("names", "why"),
    [
        ({"controller": "FolowPath"}, "no controller 'FolowPath'; there is: FollowPath, PurePursuit; did you mean"),
        ({"goal_checker": "none"}, "no goal checker 'none'"),
        ({"progress_checker": "progres_checker"}, "did you mean 'progress_checker'?"),
        ({"path_handler": "Other"}, "no path handler 'Other'; there is: PathHandler"),
    ],
)
def test_a_name_that_nothing_has_is_reported(bench: Bench, names: dict[str, Any], why: str) -> None:
    done = bench.finish(follow(bench, 3.4, 2.0, **names), within=2.0)
    assert done.error_code == FollowError.INVALID_CONTROLLER
    assert why in done.error_msg


def test_an_empty_path_and_one_in_an_unknown_frame_are_reported(bench: Bench) -> None:
    assert bench.do("follow_path", FollowPath(Path()), PathFollowed).error_code == FollowError.INVALID_PATH
    moon = Path(0.0, "moon", bench.plan(3.4, 2.0).path.poses)
    done = bench.do("follow_path", FollowPath(moon), PathFollowed)
    assert (done.error_code, done.error_msg) == (FollowError.NO_POSE, "path: the frame must be map or odom, is 'moon'")


def test_a_blocked_path_is_given_up_after_a_while(bench: Bench) -> None:
    goal = follow(bench, 3.4, 2.0)
    bench.surprise(AHEAD)
    done = bench.finish(goal, within=20.0)
    assert done.error_code == FollowError.PATIENCE_EXCEEDED
    assert "obstacles block the path, for 2 s" in done.error_msg
    assert bench.collisions == 0


@pytest.mark.parametrize("moved", [0, 1000], ids=["simulated", "real"])
def test_a_robot_that_does_not_get_on_is_given_up_also_with_a_new_path_each_second(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, moved: int
) -> None:
    """A real clock has moved on by each look at it."""
    looks, now = itertools.count(), SteppedClock.now
    monkeypatch.setattr(SteppedClock, "now", lambda clock: now(clock) + moved * next(looks))
    bench.stage.motors = False
    goal = follow(bench, 3.4, 2.0)
    for second in range(20):
        bench.run(1.0)
        if goal.result is not None:
            break
        goal = follow(bench, 3.4, 2.0 + 0.01 * (second % 3))
    assert goal.result is not None
    assert goal.result.error_code == FollowError.FAILED_TO_MAKE_PROGRESS


def test_a_newer_path_replaces_the_one_before_without_a_stop(bench: Bench) -> None:
    first = follow(bench, 3.4, 2.0)
    bench.run(3.0)
    second = follow(bench, 3.0, 1.6)
    slowest = 1.0
    for _ in range(10):
        bench.run(0.05)
        slowest = min(slowest, bench.stage.robot.twist.v)
    assert slowest > 0.1
    assert first.error is not None
    assert bench.finish(second) == PathFollowed()
    assert bench.is_at(3.0, 1.6)


def test_missing_odometry_stops_the_robot_and_ends_with_a_code(bench: Bench) -> None:
    goal = follow(bench, 3.4, 2.0)
    bench.run(3.0)
    bench.stage.odometry = False
    bench.run(2.0)
    assert bench.stage.robot.twist.v == 0.0
    done = bench.finish(goal, within=15.0)
    assert done.error_code == FollowError.NO_POSE
    assert "no odometry comes, for 10 s" in done.error_msg


@pytest.mark.parametrize(
    ("name", "asked", "clears"),
    [
        ("entirely", ClearCostmap(), True),
        ("except", ClearCostmap(4.0), False),
        ("except", ClearCostmap(1.0), True),
        ("around", ClearCostmap(1.0), False),
        ("around_pose", ClearCostmap(1.0, framed(2.0, 2.0)), True),
    ],
)
def test_the_local_costmap_is_cleared_by_the_name_of_the_service(
    bench: Bench, name: str, asked: ClearCostmap, clears: bool
) -> None:
    bench.surprise(Box(2.0, 2.0, 0.4, 0.4))
    bench.run(1.0)
    cleared = bench.rig.call(f"local_costmap/clear_{name}_local_costmap", asked, CostmapCleared)
    assert cleared.success
    assert (cleared.cleared > 3) is clears


# --- single motions ---


@pytest.mark.parametrize("angle", [1.57, -1.57, 5.0, 0.0])
def test_a_spin_turns_by_its_angle_in_its_direction(bench: Bench, angle: float) -> None:
    goal = bench.ask("spin", Spin(angle), MotionDone, MotionProgress)
    done = bench.finish(goal)
    assert done.error_code == 0
    assert abs(wrap_angle(bench.pose.yaw - angle)) < 0.08
    if abs(angle) > 1.0:
        assert goal.feedback is not None
        assert goal.feedback.travelled > 1.0
        assert done.total_elapsed_time > 1.0


def test_a_spin_without_room_fails_and_touches_nothing() -> None:
    with Rig() as rig:
        bench = Bench.of(rig, START, [*ROOM, Box(0.8, 2.0, 0.1, 1.0)])
        done = move(bench, "spin", Spin(3.0))
        assert done.error_code == 703
        assert "something is in the way" in done.error_msg
        assert bench.collisions == 0


def test_a_spin_without_checks_turns_nevertheless() -> None:
    with Rig() as rig:
        bench = Bench.of(rig, START, [*ROOM, Box(0.8, 2.0, 0.1, 1.0)])
        assert move(bench, "spin", Spin(3.0, disable_collision_checks=True)).error_code == 0


def test_a_way_back_and_a_way_on_are_driven_straight(bench: Bench) -> None:
    assert move(bench, "drive_on_heading", DriveStraight(1.0, 0.2)).error_code == 0
    assert bench.is_at(1.6, 2.0, 0.03)
    assert move(bench, "backup", DriveStraight(0.5, 0.1)).error_code == 0
    assert bench.is_at(1.1, 2.0, 0.03)
    assert move(bench, "drive_on_heading", DriveStraight(-0.3, -0.1)).error_code == 0
    assert bench.is_at(0.8, 2.0, 0.03)
    assert bench.pose.yaw == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("action", "box", "goal", "code"),
    [
        ("drive_on_heading", AHEAD, DriveStraight(2.0, 0.2), 723),
        ("backup", BEHIND, DriveStraight(0.4, 0.1), 714),
    ],
)
def test_a_straight_way_into_something_fails_and_touches_nothing(
    bench: Bench, action: str, box: Box, goal: DriveStraight, code: int
) -> None:
    bench.surprise(box)
    bench.run(0.5)
    assert move(bench, action, goal).error_code == code
    assert bench.collisions == 0


@pytest.mark.parametrize("goal", [DriveStraight(1.0, -0.1), DriveStraight(0.0, 0.1), DriveStraight(1.0, 0.0)])
def test_distance_and_speed_of_different_signs_are_invalid(bench: Bench, goal: DriveStraight) -> None:
    done = move(bench, "drive_on_heading", goal)
    assert done.error_code == 724
    assert "must have the same sign, and none be 0" in done.error_msg


@pytest.mark.parametrize(
    ("action", "goal", "code"),
    [("spin", Spin(6.0, 1.0), 701), ("backup", DriveStraight(0.3, 0.01, 1.0), 711),
     ("drive_on_heading", DriveStraight(2.0, 0.1, 1.0), 721), ("assisted_teleop", AssistedTeleop(1.0), 731)],
)  # fmt: skip
def test_a_motion_that_takes_too_long_fails(bench: Bench, action: str, goal: object, code: int) -> None:
    done = move(bench, action, goal)
    assert done.error_code == code
    assert "within 1 s" in done.error_msg
    bench.run(0.3)
    assert (bench.stage.robot.twist.v, bench.stage.robot.twist.w) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("action", "goal"),
    [("spin", Spin(1.57)), ("backup", DriveStraight(0.3, 0.1)), ("drive_on_heading", DriveStraight(1, 0.2))],
)
@pytest.mark.parametrize("missing", ["odometry", "scans"])
def test_a_motion_that_begins_blind_is_done_once_something_is_seen(
    bench: Bench, action: str, goal: Spin | DriveStraight, missing: str
) -> None:
    before = bench.pose
    setattr(bench.stage, missing, False)
    bench.run(2.0)
    given = bench.ask(action, goal, MotionDone)
    bench.run(1.0)
    assert not given.done
    setattr(bench.stage, missing, True)
    assert bench.finish(given).error_code == 0
    if isinstance(goal, Spin):
        assert abs(wrap_angle(bench.pose.yaw - before.yaw - goal.target_yaw)) < 0.08
    else:
        assert bench.pose.distance(before) == pytest.approx(goal.distance, abs=0.03)


@pytest.mark.parametrize("time", [2.0, -2.0])
def test_a_wait_stands_for_its_time_also_without_a_lidar(bench: Bench, time: float) -> None:
    bench.stage.scans = False
    done = move(bench, "wait", Wait(time))
    assert done.error_code == 0
    assert done.total_elapsed_time == pytest.approx(2.0, abs=0.1)
    assert bench.is_at(*START.position, 0.001)


def test_driving_by_hand_stops_before_something(bench: Bench) -> None:
    bench.surprise(AHEAD)
    goal = bench.ask("assisted_teleop", AssistedTeleop(8.0), MotionDone)
    for _ in range(70):
        bench.rig.publish("teleop", Twist.planar(0.2, 0.0))
        bench.run(0.1)
    assert bench.pose.x > 0.9
    assert bench.collisions == 0
    bench.run(0.7)
    assert bench.stage.robot.twist.v == 0.0, "an old twist counts for nothing"
    assert not goal.done or goal.result is not None


@pytest.mark.parametrize(
    ("action", "goal"),
    [("spin", Spin(6.0)), ("backup", DriveStraight(0.3, 0.02)), ("drive_on_heading", DriveStraight(2.0, 0.1)),
     ("wait", Wait(9.0)), ("assisted_teleop", AssistedTeleop(9.0))],
)  # fmt: skip
def test_a_motion_can_be_cancelled_by_anybody(bench: Bench, action: str, goal: object) -> None:
    given = bench.ask(action, goal, MotionDone)
    bench.run(1.0)
    assert bench.rig.call(f"{action}/cancel", CancelGoals(), GoalsCancelled).count == 1
    done = bench.finish(given, within=1.0)
    assert done.cancelled
    assert done.error_code == 0
    bench.run(0.3)
    assert (bench.stage.robot.twist.v, bench.stage.robot.twist.w) == (0.0, 0.0)
    assert bench.rig.call(f"{action}/cancel", CancelGoals(), GoalsCancelled).count == 0


def test_a_motion_replaces_that_of_another_action(bench: Bench) -> None:
    path = follow(bench, 3.4, 2.0)
    bench.run(2.0)
    assert move(bench, "spin", Spin(math.pi / 2)).error_code == 0
    assert path.result is not None
    assert path.result.cancelled
