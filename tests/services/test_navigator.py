"""Promises of the navigator as a component, driving the simulated robot."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import FramedPose, Pose, Twist
from regraft.bus_schema.messages.maps import Goals, OccupancyGrid
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.goal import Goal
from regraft.services.navigator.navigator import Navigator
from regraft.sim_service.map_server import MapServer
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD

from .rigs import finish, run, set_parameters, world_on

pytestmark = pytest.mark.slow

Drive = Goal[Arrival, NavigationProgress]


@dataclass
class Course:
    """FROG with a robot that can be sent to goals."""

    rig: Rig
    world: World
    navigator: Navigator
    goals: dict[str, FramedPose]
    commands: list[Twist]
    truth: list[GroundTruth]

    def send(self, goal: FramedPose | str) -> Drive:
        """Send the robot to a goal, or to look at an object."""
        target = self.goals[goal] if isinstance(goal, str) else goal
        return self.rig.goal("navigate_to", NavigateTo(target), Arrival, NavigationProgress)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        run(self.rig, self.world, seconds)


@pytest.fixture
def course() -> Iterator[Course]:
    """Return FROG with everything in place, two seconds into the run."""
    with Rig(seed=2) as rig:
        world = world_on(rig)
        rig.add(MapServer, "map_server", FROG_WORLD)
        goals = rig.collect("goals", Goals)
        navigator = rig.add(Navigator)
        commands, truth = rig.collect("velocity", Twist), rig.collect("ground_truth", GroundTruth)
        run(rig, world, 2.0)
        named = {goal.name: goal.pose for goal in goals[0].goals}
        yield Course(rig, world, navigator, named, commands, truth)


def test_goals_behind_obstacles_are_reached_without_touching_anything(course: Course) -> None:
    for name, goal in course.goals.items():
        drive = finish(course.rig, course.world, course.send(name))
        assert drive.result is not None, drive.error
        assert drive.result.arrived, drive.result.reason
        pose = course.truth[-1].pose
        assert math.hypot(pose.x - goal.pose.x, pose.y - goal.pose.y) < 0.15
        assert abs(math.remainder(pose.yaw - goal.pose.yaw, math.tau)) < 0.2
    assert course.truth[-1].contacts == 0


def test_progress_is_told_twice_a_second(course: Course) -> None:
    told: list[NavigationProgress | None] = []
    drive = course.send("hydrant")
    for _ in range(20):
        course.run(0.25)
        if not told or told[-1] is not drive.feedback:
            told.append(drive.feedback)
    assert 9 <= len(told) <= 11
    first, last = told[1], told[-1]
    assert first is not None
    assert last is not None
    assert last.distance_left < first.distance_left
    assert last.phase in ("driving", "turning")


def test_max_velocity_holds_from_the_next_command_on(course: Course) -> None:
    course.send("hydrant")
    course.run(4.0)
    assert 0.2 < max(command.forward for command in course.commands) <= 0.26
    for limit in (0.18, 0.05, 0.0, 0.10):
        before = len(course.commands)
        set_parameters(course.rig, "navigator", max_velocity=limit)
        course.run(1.0)
        since = course.commands[before:]
        assert len(since) == 20
        assert max(abs(command.forward) for command in since) <= limit + 1e-12


def test_it_commands_while_driving_stops_once_and_is_silent_when_idle(course: Course) -> None:
    assert not course.commands
    finish(course.rig, course.world, course.send("hydrant"))
    course.run(0.1)
    assert course.commands[-1] == Twist()
    count = len(course.commands)
    course.run(1.0)
    assert len(course.commands) == count


def test_a_new_goal_replaces_the_old_one_without_a_stop(course: Course) -> None:
    first = course.send("hydrant")
    course.run(5.0)
    count = len(course.commands)
    second = course.send("middle_box")
    assert first.done
    assert first.error is not None
    assert "replaced by a newer goal" in str(first.error)
    course.run(0.5)
    assert Twist() not in course.commands[count:]
    finish(course.rig, course.world, second)
    assert second.result is not None
    assert second.result.arrived


def test_a_cancelled_drive_stops(course: Course) -> None:
    drive = course.send("hydrant")
    course.run(5.0)
    drive.cancel()
    course.run(1.0)
    assert drive.error is not None
    assert course.commands[-1] == Twist()
    assert abs(course.truth[-1].twist.forward) < 0.01


def test_deactivating_it_stops_the_robot_and_refuses_goals(course: Course) -> None:
    drive = course.send("hydrant")
    course.run(5.0)
    course.rig.transition("navigator", Transition.DEACTIVATE)
    assert drive.error is not None
    assert "deactivated" in str(drive.error)
    assert course.commands[-1] == Twist()
    count = len(course.commands)
    refused = course.send("hydrant")
    course.run(1.0)
    assert "only while active" in str(refused.error)
    assert len(course.commands) == count
    course.rig.transition("navigator", Transition.ACTIVATE)
    again = finish(course.rig, course.world, course.send("hydrant"))
    assert again.result is not None
    assert again.result.arrived


def test_an_unreachable_goal_is_given_up_with_the_reason(course: Course) -> None:
    outside = FramedPose("map", Pose.planar(9.0, 0.0, 0.0))
    drive = finish(course.rig, course.world, course.send(outside))
    assert drive.result is not None
    assert not drive.result.arrived
    assert "map" in drive.result.reason


def test_a_goal_in_another_frame_is_refused(course: Course) -> None:
    drive = course.send(FramedPose("base_link", Pose.planar(1.0, 0.0, 0.0)))
    course.run(0.1)
    assert "goal.frame: must be map or odom, is 'base_link'" in str(drive.error)


def test_without_odometry_the_robot_stops_and_the_drive_is_given_up(course: Course) -> None:
    drive = course.send("hydrant")
    course.run(5.0)
    course.rig.transition("world", Transition.DEACTIVATE)
    course.rig.advance(2.0)
    assert course.commands[-1] == Twist()
    assert not drive.done
    course.rig.advance(10.0)
    assert drive.result is not None
    assert not drive.result.arrived
    assert "no odometry" in drive.result.reason


@pytest.mark.parametrize("given", ["nothing", "odometry", "map"])
def test_a_goal_without_map_or_odometry_is_refused_and_says_what_is_missing(given: str) -> None:
    with Rig() as rig:
        rig.add(Navigator)
        if given == "odometry":
            rig.publish("odometry", Odometry(0.0, "odom", "base_link", Pose(), Twist()))
        if given == "map":
            rig.publish("map", OccupancyGrid(0.0, "map", 0.05, Pose(), np.zeros((40, 40), np.int8)))
        drive: Drive = rig.goal("navigate_to", NavigateTo(FramedPose("map", Pose())), Arrival)
        rig.advance(4.9)
        assert not drive.done
        rig.advance(0.2)
    assert ("no map" in str(drive.error).replace("usable ", "")) == (given != "map")
    assert ("no odometry" in str(drive.error)) == (given != "odometry")


def test_a_successor_with_its_state_finishes_the_drive(course: Course) -> None:
    course.send("hydrant")
    course.run(5.0)
    snapshot = codec.encode(course.rig.runtimes["navigator"].checkpoints.snapshot())
    course.rig.transition("navigator", Transition.DEACTIVATE)
    successor = course.rig.add(Navigator, "successor", {}, state=State.INACTIVE)
    successor.restore(codec.unpack_plain(snapshot)["state"])
    course.rig.runtimes["navigator"].leave()
    del course.rig.runtimes["navigator"]
    course.rig.transition("successor", Transition.ACTIVATE)
    drive = finish(course.rig, course.world, course.send("hydrant"))
    assert drive.result is not None
    assert drive.result.arrived


def test_its_qualities_are_those_of_the_power_model() -> None:
    slow, fast = (Navigator.estimate({"max_velocity": v}, {}) for v in (0.10, 0.26))
    assert slow["power"] < fast["power"] == pytest.approx(6.63, abs=0.01)
    assert slow["energy_per_metre"] == pytest.approx(47.0, abs=0.1)
    assert fast["energy_per_metre"] == pytest.approx(25.5, abs=0.1)
