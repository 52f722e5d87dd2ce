"""Nav2's default tree when something goes wrong: it waits, plans again, recovers, and in the end gives up."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.bus_schema.messages.nav2.paths import FollowError, PlanError
from regraft.testing import Rig

from ..executor.helpers import command
from ..navigator.stage import ROOM, room_map
from ..navigator.world import Box
from .bench import GOAL, START, Bench

pytestmark = pytest.mark.slow

DEFAULT = "navigate_to_pose_w_replanning_and_recovery"
CORRIDOR = [*ROOM, Box(2.0, 1.5, 4.0, 0.1), Box(2.0, 2.5, 4.0, 0.1)]
PERSON = Box(2.0, 2.0, 0.3, 0.8)
CHAIR = Box(2.0, 2.0, 0.4, 0.4)
WALL = Box(2.0, 2.0, 0.1, 4.0)
INVALID = "navigate_w_replanning_only_if_path_becomes_invalid"


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


@pytest.fixture
def corridor() -> Iterator[Bench]:
    """Return a robot in a corridor that a person fills."""
    with Rig() as rig:
        yield Bench.of(rig, START, CORRIDOR)


def test_something_that_the_map_lacks_is_driven_around(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.tree(DEFAULT, goal=GOAL)
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.is_at(3.4, 2.0)
    assert bench.collisions == 0


def test_a_person_who_steps_into_the_way_and_leaves_is_waited_for(corridor: Bench) -> None:
    corridor.tree(DEFAULT, goal=GOAL)
    corridor.run(2.0)
    corridor.stage.robot.boxes = [*CORRIDOR, PERSON]
    assert corridor.run_until(lambda: corridor.ticked("RecoveryActions") or corridor.ticked("Wait"), 30.0)
    assert corridor.pose.x < 1.8
    corridor.stage.robot.boxes = CORRIDOR
    assert corridor.ended() is MissionState.SUCCEEDED
    assert corridor.is_at(3.4, 2.0)
    assert corridor.collisions == 0


def test_a_passage_that_stays_blocked_ends_in_failure_after_all_recoveries(corridor: Bench) -> None:
    corridor.surprise(PERSON)
    corridor.tree(DEFAULT, goal=GOAL)
    recoveries = set()
    while corridor.state() is MissionState.RUNNING and corridor.stage.robot.time < 180.0:
        corridor.run(0.25)
        recoveries |= {name for name in ("Spin", "Wait", "BackUp") if corridor.ticked(f"{name}::")}
    assert corridor.state() is MissionState.FAILED
    assert recoveries == {"Wait", "BackUp"}, "there is no room to spin"
    assert corridor.value("follow_path_error_code") == FollowError.PATIENCE_EXCEEDED
    assert "obstacles block the path" in corridor.value("follow_path_error_msg")
    assert corridor.collisions == 0


def test_a_path_that_becomes_invalid_is_planned_again(bench: Bench) -> None:
    bench.tree(INVALID, goal=GOAL)
    bench.run(1.5)
    before = bench.value("path")
    bench.run(2.0)
    assert bench.value("path") == before, "a valid path stays"
    bench.surprise(Box(2.4, 2.0, 0.3, 0.3))
    assert bench.run_until(lambda: bool(bench.value("path") != before), 5.0)
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.collisions == 0


def test_a_goal_without_a_way_fails_with_its_code(bench: Bench) -> None:
    bench.stage.show_map(room_map([*ROOM, WALL]))
    bench.tree(DEFAULT, goal=GOAL)
    assert bench.ended(180.0) is MissionState.FAILED
    assert bench.value("compute_path_error_code") == PlanError.NO_VALID_PATH


@pytest.mark.parametrize(
    ("goal", "code"), [([9.0, 2.0], PlanError.GOAL_OUTSIDE_MAP), ([2.0, 2.0], PlanError.GOAL_OCCUPIED)]
)
def test_a_goal_that_no_recovery_helps_fails_at_once(goal: list[float], code: PlanError) -> None:
    block = Box(2.0, 2.0, 1.6, 1.6)
    with Rig() as rig:
        bench = Bench.of(rig, START, [*ROOM, block])
        bench.tree(DEFAULT, goal=goal)
        assert bench.ended(2.0) is MissionState.FAILED
        assert code == bench.value("compute_path_error_code")
        assert math.dist(bench.pose.position, START.position) < 0.01


def test_another_goal_under_way_is_driven_to_without_a_stop(bench: Bench) -> None:
    bench.tree(DEFAULT, goal=GOAL)
    bench.run(4.0)
    bench.write(goal=[3.0, 1.4, 0.0])
    slowest = 1.0
    for _ in range(30):
        bench.run(0.05)
        slowest = min(slowest, bench.stage.robot.twist.v)
    assert slowest > 0.05
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.is_at(3.0, 1.4)


def test_a_halted_mission_stops_the_robot(bench: Bench) -> None:
    bench.tree(DEFAULT, goal=GOAL)
    bench.run(3.0)
    assert bench.stage.robot.twist.v > 0.1
    command(bench.rig, Command.HALT)
    bench.run(0.5)
    assert bench.stage.robot.twist.v == 0.0
    before = bench.pose
    bench.run(1.0)
    assert bench.pose == before


def test_a_robot_that_does_not_get_on_is_recovered(bench: Bench) -> None:
    bench.tree(DEFAULT, goal=GOAL)
    bench.run(2.0)
    bench.stage.motors = False
    assert bench.run_until(lambda: bench.value("follow_path_error_code") == FollowError.FAILED_TO_MAKE_PROGRESS, 20.0)
    bench.stage.motors = True
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.is_at(3.4, 2.0)


def test_a_lidar_that_falls_silent_stops_the_robot_until_it_is_back(bench: Bench) -> None:
    bench.tree(DEFAULT, goal=GOAL)
    bench.run(3.0)
    bench.stage.scans = False
    bench.run(2.0)
    assert bench.stage.robot.twist.v == 0.0
    bench.stage.scans = True
    assert bench.ended() is MissionState.SUCCEEDED
