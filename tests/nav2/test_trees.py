"""Nav2's fifteen trees, as they are, on a robot in a room, and FROG's mission by one of them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.geometry import StampedPose
from regraft.bus_schema.messages.maps import Goals, NamedGoal
from regraft.bus_schema.messages.mission import MissionState
from regraft.planar import Pose2D
from regraft.services.bt_executor.navigation.navigation_executor import NavigationExecutor
from regraft.services.navigator.servers.route_server import RouteServer
from regraft.testing import Rig
from tests.support.paths import FROG

from .bench import GOAL, TREES, Bench, add, framed

pytestmark = pytest.mark.slow

TO_A_POSE = (
    "nav_to_pose_with_consistent_replanning_and_if_path_becomes_invalid",
    "navigate_to_pose_w_bounds_check",
    "navigate_to_pose_w_replanning_and_recovery",
    "navigate_to_pose_w_replanning_goal_patience_and_recovery",
    "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid",
    "navigate_w_replanning_distance",
    "navigate_w_replanning_only_if_goal_is_updated",
    "navigate_w_replanning_only_if_path_becomes_invalid",
    "navigate_w_replanning_speed",
    "navigate_w_replanning_time",
)
ON_A_GRAPH = (
    "navigate_on_route_graph_w_recovery",
    "navigate_w_routing_global_planning_and_control_w_recovery",
)
OTHERS = ("follow_point", "navigate_through_poses_w_replanning_and_recovery", "odometry_calibration")
NODES = [{"id": 1, "x": 0.6, "y": 1.0}, {"id": 2, "x": 2.0, "y": 1.0}, {"id": 3, "x": 3.4, "y": 1.6}]
EDGES = [{"start": 1, "end": 2}, {"start": 2, "end": 3}]


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


def test_there_are_fifteen_trees() -> None:
    assert {file.stem for file in TREES.glob("*.xml")} == {*TO_A_POSE, *ON_A_GRAPH, *OTHERS}


@pytest.mark.parametrize("name", TO_A_POSE)
def test_a_tree_for_a_pose_brings_the_robot_there(bench: Bench, name: str) -> None:
    bench.tree(name, goal=GOAL)
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.is_at(3.4, 2.0)
    assert bench.collisions == 0


@pytest.mark.parametrize("name", ON_A_GRAPH)
def test_a_tree_for_a_route_brings_the_robot_to_its_goal(bench: Bench, name: str) -> None:
    add(bench.rig, RouteServer, "routes", nodes=NODES, edges=EDGES)
    bench.tree(name, goal=GOAL)
    lowest = bench.pose.y
    for _ in range(60):
        bench.run(1.0)
        lowest = min(lowest, bench.pose.y)
    assert bench.state() is MissionState.SUCCEEDED
    assert bench.is_at(3.4, 2.0)
    # The other tree leaves out nodes within 3 m of the robot, so in this room it drives straight to its goal.
    assert (lowest < 1.6) is (name == "navigate_on_route_graph_w_recovery")
    assert bench.collisions == 0


def test_the_tree_through_poses_passes_each_of_them(bench: Bench) -> None:
    places = [(1.2, 3.2), (2.4, 0.9), (3.4, 2.0)]
    bench.tree("navigate_through_poses_w_replanning_and_recovery", goals=[[*place, 0.0] for place in places])
    nearest = [9.0] * len(places)
    for _ in range(900):
        bench.run(0.1)
        here = bench.pose.position
        nearest = [min(before, math.dist(here, place)) for before, place in zip(nearest, places, strict=True)]
        if bench.is_at(3.4, 2.0):
            break
    assert bench.ended() is MissionState.SUCCEEDED
    assert bench.is_at(3.4, 2.0)
    assert max(nearest) < 0.7
    assert bench.collisions == 0


def test_the_tree_that_follows_a_point_stays_a_metre_behind_it(bench: Bench) -> None:
    bench.tree("follow_point", goal=[2.6, 2.0, 0.0])
    assert bench.run_until(lambda: bench.is_at(1.6, 2.0, 0.2), 30.0)
    bench.run(5.0)
    assert bench.is_at(1.6, 2.0, 0.2)
    bench.rig.publish("goal_update", StampedPose(bench.stage.robot.time, "map", framed(2.6, 3.4).pose))
    bench.run(15.0)
    assert bench.state() is MissionState.RUNNING
    assert math.dist(bench.pose.position, (2.6, 3.4)) == pytest.approx(1.0, abs=0.25)


def test_the_goal_of_frogs_running_mission_may_be_replaced(bench: Bench) -> None:
    bench.rig.add(NavigationExecutor, "bt_executor", {"mission": str(FROG / "missions" / "nav2.xml")})
    bench.rig.publish("goals", Goals(0.0, (NamedGoal("far", framed(3.4, 2.0)),)))
    assert bench.run_until(lambda: bench.pose.x > 0.8, 20.0)
    near = {"name": "near", "pose": {"frame": "map", "pose": {"position": {"x": 1.0, "y": 3.0}}}}
    bench.write(goal=near)
    assert bench.run_until(lambda: bench.is_at(1.0, 3.0), 30.0)
    assert bench.state() is MissionState.RUNNING


def test_the_calibration_tree_drives_three_squares() -> None:
    with Rig() as rig:
        bench = Bench.of(rig, Pose2D(1.0, 1.0, 0.0))
        bench.tree("odometry_calibration")
        farthest = 0.0
        while bench.state() is MissionState.RUNNING and bench.stage.robot.time < 300.0:
            bench.run(1.0)
            farthest = max(farthest, math.dist(bench.pose.position, (1.0, 1.0)))
        assert bench.state() is MissionState.SUCCEEDED
        assert bench.is_at(1.0, 1.0, 0.5)
        assert farthest == pytest.approx(math.hypot(2.0, 2.0), abs=0.4)
        assert bench.collisions == 0
