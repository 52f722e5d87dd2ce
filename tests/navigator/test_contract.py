"""What every navigator promises, whatever controls it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import describe
from regraft.planar import Pose2D, wrap_angle
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.pursuit_navigator import PursuitNavigator
from regraft.testing import Rig

from ..services.rigs import set_parameters
from .stage import ROOM, Stage, room_map
from .world import FROG_BOXES, Box, frog_map

pytestmark = pytest.mark.slow

START = Pose2D(0.6, 2.0, 0.0)
DIVIDED = [*ROOM, Box(2.0, 1.4, 0.1, 2.8)]
"""The room with a wall that is open above y = 2.8."""
WALL = Box(2.0, 2.0, 0.1, 4.0)


@pytest.fixture(params=[Navigator, PursuitNavigator], ids=["rollouts", "pursuit"])
def kind(request: pytest.FixtureRequest) -> type[Navigator]:
    """Return one of the classes."""
    found: type[Navigator] = request.param
    return found


@pytest.fixture
def stage(kind: type[Navigator]) -> Iterator[Stage]:
    """Return an empty room with a robot at its left side."""
    with Rig() as rig:
        yield Stage.of(rig, kind, START)


def still(stage: Stage) -> bool:
    return stage.robot.twist.v == 0.0 and stage.robot.twist.w == 0.0


def told(stage: Stage, subject: str) -> list[Level]:
    return [diagnostic.level for diagnostic in stage.diagnostics if diagnostic.subject == subject]


@pytest.mark.parametrize("seed", range(2))
def test_goals_in_a_cluttered_room_are_reached_in_tolerance_without_touching_anything(
    kind: type[Navigator], seed: int
) -> None:
    noise = np.random.default_rng(seed)
    with Rig() as rig:
        stage = Stage.of(rig, kind, Pose2D(1.6, -1.6, 1.0), FROG_BOXES)
        stage.show_map(frog_map())
        for x, y in noise.permutation([(-1.5, 1.6), (0.2, 0.2), (1.8, 1.7), (-1.6, -1.7)])[:2].tolist():
            yaw = float(noise.uniform(-3.1, 3.1))
            arrival = stage.finish(stage.send(x, y, yaw))
            assert arrival.arrived, arrival.reason
            assert math.dist(stage.robot.pose.position, (x, y)) <= 0.16
            assert abs(wrap_angle(stage.robot.pose.yaw - yaw)) <= 0.15
    assert stage.robot.collisions == []


def test_max_velocity_is_obeyed_also_when_it_changes_under_way(stage: Stage) -> None:
    stage.send(3.4, 2.0)
    stage.run(2.0)
    assert max(command.forward for command in stage.commands) == pytest.approx(0.26)
    for limit in (0.18, 0.05, 0.0, 0.12):
        set_parameters(stage.rig, "navigator", max_velocity=limit)
        stage.run(0.05)
        before = len(stage.commands)
        stage.run(0.95)
        assert len(stage.commands) > before
        assert max(abs(command.forward) for command in stage.commands[before:]) <= limit + 1e-12


def test_distance_and_time_left_are_told_and_shrink(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(1.0)
    first = drive.feedback
    stage.run(6.0)
    later = drive.feedback
    assert first is not None
    assert later is not None
    assert later.distance_left < first.distance_left - 1.0
    assert later.time_left < first.time_left - 4.0
    assert first.time_left == pytest.approx(first.distance_left / 0.26, rel=0.2)


def test_someone_in_the_way_stops_the_robot_until_he_leaves(kind: type[Navigator]) -> None:
    corridor = [*ROOM, Box(2.0, 1.5, 4.0, 0.1), Box(2.0, 2.5, 4.0, 0.1)]
    with Rig() as rig:
        stage = Stage.of(rig, kind, START, corridor)
        drive = stage.send(3.4, 2.0)
        stage.run(2.0)
        stage.robot.boxes = [*corridor, Box(1.9, 2.0, 0.3, 0.8)]
        stage.run(6.0)
        assert abs(stage.robot.twist.v) < 0.06
        assert not drive.done
        stage.robot.boxes = corridor
        assert stage.finish(drive).arrived
    assert stage.robot.collisions == []


def test_box_that_the_map_lacks_is_driven_around(stage: Stage) -> None:
    stage.robot.boxes = [*ROOM, Box(2.0, 2.1, 0.4, 0.6)]
    arrival = stage.finish(stage.send(3.4, 2.0))
    assert arrival.arrived, arrival.reason
    assert stage.robot.collisions == []


def test_goal_that_nothing_leads_to_is_reported_with_the_reason(kind: type[Navigator]) -> None:
    with Rig() as rig:
        stage = Stage.of(rig, kind, START, [*ROOM, WALL])
        arrival = stage.finish(stage.send(3.4, 2.0), within=1.0)
    assert not arrival.arrived
    assert "no path from (0.600, 2.000) to (3.400, 2.000)" in arrival.reason


def test_way_that_a_growing_map_closes_is_reported_with_the_reason(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(1.0)
    stage.robot.boxes = [*ROOM, WALL]
    stage.show_map(room_map(stage.robot.boxes))
    arrival = stage.finish(drive, within=8.0)
    assert not arrival.arrived
    assert "the obstacles of the map leave no way" in arrival.reason
    assert stage.robot.collisions == []


def test_room_that_becomes_known_on_the_way_is_crossed_around_its_wall(kind: type[Navigator]) -> None:
    whole = room_map(DIVIDED).cells
    with Rig() as rig:
        stage = Stage.of(rig, kind, Pose2D(0.6, 0.6, 0.0), DIVIDED)
        stage.show_map(OccupancyGrid(np.full((84, 84), -1, np.int8), 0.05, -0.1, -0.1))
        drive = stage.send(3.4, 0.6)
        for columns in range(10, 85, 3):
            known = np.full((84, 84), -1, np.int8)
            known[:, :columns] = whole[:, :columns]
            stage.show_map(OccupancyGrid(known, 0.05, -0.1, -0.1))
            stage.run(1.0)
        arrival = stage.finish(drive)
    assert arrival.arrived, arrival.reason
    assert stage.robot.collisions == []


def test_new_map_that_changes_nothing_on_the_way_does_not_disturb_the_drive(kind: type[Navigator]) -> None:
    ends = []
    for new_maps in (False, True):
        with Rig() as rig:
            stage = Stage.of(rig, kind, START)
            drive = stage.send(3.4, 2.0)
            for turn in range(6):
                if new_maps:
                    grid = room_map(ROOM)
                    grid.cells[70 + turn, 10] = 100
                    stage.show_map(grid)
                stage.run(1.0)
            ends.append(stage.finish(drive).arrived and stage.robot.time)
    assert ends[1] == pytest.approx(ends[0], abs=0.5)


def test_pose_that_jumps_when_it_is_corrected_leads_to_the_goal_without_wavering(stage: Stage) -> None:
    stage.robot.boxes = [*ROOM, Box(2.0, 2.45, 0.3, 0.3), Box(2.0, 1.5, 0.3, 0.3)]
    stage.show_map(room_map(stage.robot.boxes))
    noise = np.random.default_rng(4)
    drive = stage.send(3.4, 2.0)
    while not drive.done and stage.robot.time < 60.0:
        x, y, yaw = (noise.uniform(-1, 1, 3) * [0.04, 0.04, 0.02]).tolist()
        stage.correction = Pose2D(x, y, yaw)
        stage.run(0.7)
    assert drive.result is not None
    assert drive.result.arrived, drive.result.reason
    assert math.dist(stage.robot.pose.position, (3.4, 2.0)) <= 0.25
    assert stage.robot.time < 25.0
    assert stage.robot.collisions == []


def test_cancelling_stops_the_robot(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    assert stage.robot.twist.v > 0.2
    drive.cancel()
    stage.run(0.2)
    assert stage.commands[-1] == Twist()
    assert still(stage)


def test_silent_lidar_stops_the_robot_within_a_second_and_in_the_end_the_drive(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    stage.scans = False
    stage.run(1.0)
    assert still(stage)
    assert told(stage, "scan") == [Level.ERROR]
    arrival = stage.finish(drive, within=12.0)
    assert "no laser scan comes, for 10 s" in arrival.reason


def test_lidar_that_speaks_again_lets_the_robot_go_on(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    stage.scans = False
    stage.run(3.0)
    stage.scans = True
    assert stage.finish(drive).arrived
    assert told(stage, "scan") == [Level.ERROR, Level.OK]


@pytest.mark.parametrize("lost", [0.95, 1.0])
def test_lidar_that_sees_nothing_where_walls_must_be_stops_the_robot(stage: Stage, lost: float) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    stage.lost_beams = lost
    stage.run(1.0)
    assert still(stage)
    assert told(stage, "scan") == [Level.ERROR]
    assert "the lidar is blind" in stage.finish(drive, within=12.0).reason


def test_robot_arrives_although_half_of_the_beams_get_lost(stage: Stage) -> None:
    stage.robot.boxes = [*ROOM, Box(2.0, 2.1, 0.4, 0.6)]
    stage.lost_beams = 0.5
    assert stage.finish(stage.send(3.4, 2.0)).arrived
    assert stage.robot.collisions == []


def test_scan_that_stays_the_same_although_the_robot_moves_stops_it(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    stage.frozen_scan = True
    stage.run(1.0)
    assert still(stage)
    assert "stays the same" in stage.finish(drive, within=12.0).reason
    stage.frozen_scan = False
    stage.run(0.5)
    assert told(stage, "scan") == [Level.ERROR, Level.OK]


def test_silent_odometry_stops_the_robot_and_in_the_end_the_drive(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    stage.odometry = False
    stage.run(1.0)
    assert still(stage)
    assert told(stage, "odometry") == [Level.ERROR]
    assert "no odometry comes, for 10 s" in stage.finish(drive, within=12.0).reason


def test_odometry_that_freezes_while_driving_stops_the_robot(stage: Stage) -> None:
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    stage.frozen_odometry = True
    stage.run(1.5)
    assert still(stage)
    assert told(stage, "odometry") == [Level.ERROR]
    arrival = stage.finish(drive, within=15.0)
    assert "stands still while its twist says that the robot moves" in arrival.reason
    assert stage.robot.collisions == []


def test_robot_that_does_not_move_although_told_to_stops_and_says_so(stage: Stage) -> None:
    stage.motors = False
    drive = stage.send(3.4, 2.0)
    stage.run(2.0)
    assert told(stage, "motion") == [Level.ERROR]
    assert "does not move although it is told to" in stage.finish(drive, within=60.0).reason


def test_robot_whose_motors_come_back_goes_on(stage: Stage) -> None:
    stage.motors = False
    drive = stage.send(3.4, 2.0)
    stage.run(3.0)
    stage.motors = True
    assert stage.finish(drive).arrived
    assert told(stage, "motion") == [Level.ERROR, Level.OK]


def test_successor_of_either_kind_takes_over_what_is_remembered(stage: Stage) -> None:
    stage.send(3.4, 2.0)
    stage.robot.boxes = [*ROOM, Box(2.0, 2.1, 0.4, 0.6)]
    stage.run(3.0)
    snapshot = codec.encode(stage.rig.runtimes["navigator"].checkpoints.snapshot())
    state = codec.unpack_plain(snapshot)["state"]
    stage.rig.transition("navigator", Transition.DEACTIVATE)
    for successor_kind in (Navigator, PursuitNavigator):
        name = f"next_{successor_kind.__name__.lower()}"
        successor = stage.rig.add(successor_kind, name, state=State.INACTIVE)
        successor.restore(state)
        assert successor.snapshot() == state
        stage.rig.runtimes.pop(name).leave()


def test_estimated_safety_falls_with_the_speed_allowed(kind: type[Navigator]) -> None:
    estimates = [kind.estimate({"max_velocity": v / 100}, {})["safety"] for v in range(27)]
    assert estimates == sorted(estimates, reverse=True)
    assert estimates[17] == 1.0
    assert 0.0 <= kind.estimate({"max_velocity": 0.26}, {"near": 1.0})["safety"] < estimates[26] < estimates[18]
    no_speed_is_slow = [kind.estimate({"max_velocity": v, "slow": 0.0}, {"near": 0.5})["safety"] for v in (0.0, 0.1)]
    assert no_speed_is_slow == pytest.approx([0.5, 0.5])
    slow_robot = [kind.estimate({"max_velocity": v / 100, "slow": 0.05}, {})["safety"] for v in (4, 6)]
    assert slow_robot[1] < slow_robot[0] == 1.0


def test_it_says_how_well_it_drives_now(stage: Stage) -> None:
    assert stage.navigator.evaluate()["clearance"] == pytest.approx(0.54, abs=0.05)
    stage.send(3.4, 2.0)
    stage.run(2.0)
    driving = stage.navigator.evaluate()
    assert driving["speed"] == pytest.approx(0.26, abs=0.01)
    assert driving["power"] == pytest.approx(6.63, abs=0.1)
    assert driving["safety"] == 1.0
    stage.robot.boxes = [*ROOM, Box(stage.robot.pose.x, 2.42, 0.4, 0.1)]
    stage.run(0.3)
    assert stage.navigator.evaluate()["safety"] == float(stage.robot.twist.v < 0.18)
    stage.rig.runtimes["navigator"].parameters.set({"slow": 1.0})
    assert stage.navigator.evaluate()["safety"] == 1.0


def test_needs_are_stated(kind: type[Navigator]) -> None:
    assert 0.0 < kind.resources.cpu < 0.2
    assert kind.resources.memory > 0.0


def test_a_plan_across_a_large_map_may_take_longer_than_the_handlers_of_others(kind: type[Navigator]) -> None:
    assert describe(kind).handler_timeout >= 2.0
