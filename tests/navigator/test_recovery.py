"""What stuck detection and recoveries promise."""

import numpy as np

from regraft.planar import FloatArray, Pose2D, Twist2D
from regraft.services.navigator.driving.local_controller import Manoeuvres, Situation
from regraft.services.navigator.driving.recovery import MAX_ATTEMPTS, ProgressMonitor, Recovery
from regraft.services.navigator.driving.robot import Limits

from .world import Robot

MANOEUVRES = Manoeuvres()
NOTHING = np.empty((0, 2))


def ring(radius: float) -> FloatArray:
    """Return echoes all around the robot."""
    angles = np.linspace(0.0, 6.28, 90)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def recover(recovery: Recovery, robot: Robot, obstacles: FloatArray) -> float:
    """Carry one manoeuvre out; return the fastest it drove backwards (m/s)."""
    fastest = 0.0
    now = Situation(robot.pose, robot.twist, obstacles, Limits())
    recovery.begin(robot.time, now, MANOEUVRES)
    while recovery.active:
        now = Situation(robot.pose, robot.twist, obstacles, Limits())
        decision = recovery.step(robot.time, now, MANOEUVRES)
        if decision is not None:
            robot.drive(decision.twist.v, decision.twist.w)
            fastest = max(fastest, -decision.twist.v)
    return fastest


def test_standing_robot_is_stuck_after_the_window() -> None:
    monitor, pose = ProgressMonitor(window=5.0), Pose2D(1.0, 1.0, 0.0)
    assert [monitor.stuck(t, pose, 0.26) for t in (0.0, 2.0, 4.9, 5.0)] == [False, False, False, True]


def test_robot_that_drives_or_turns_is_not_stuck() -> None:
    driving, turning = ProgressMonitor(), ProgressMonitor()
    for second in range(30):
        assert not driving.stuck(second, Pose2D(0.02 * second, 0.0, 0.0), 0.26)
        assert not turning.stuck(second, Pose2D(0.0, 0.0, 0.05 * second), 0.26)


def test_robot_that_is_only_allowed_to_creep_is_not_called_stuck_for_it() -> None:
    monitor = ProgressMonitor()
    assert not any(monitor.stuck(t, Pose2D(0.005 * t, 0.0, 0.0), 0.006) for t in range(30))


def test_robot_that_did_not_try_is_not_stuck() -> None:
    monitor, pose = ProgressMonitor(), Pose2D(0.0, 0.0, 0.0)
    monitor.stuck(0.0, pose, 0.26)
    monitor.reset()
    assert not monitor.stuck(9.0, pose, 0.26)


def test_first_manoeuvre_turns_and_the_second_backs_up_slowly() -> None:
    recovery, robot = Recovery(), Robot(Pose2D(0.0, 0.0, 0.0), [])
    recover(recovery, robot, NOTHING)
    assert abs(robot.pose.yaw) > 0.6
    assert (robot.pose.x, robot.pose.y) == (0.0, 0.0)
    assert 0.0 < recover(recovery, robot, NOTHING) <= 0.05 + 1e-9
    assert robot.pose.x < -0.08


def test_robot_with_its_back_to_a_wall_does_not_back_up() -> None:
    recovery, robot = Recovery(), Robot(Pose2D(0.0, 0.0, 0.0), [])
    behind = np.column_stack([np.full(20, -0.29), np.linspace(-0.3, 0.3, 20)])
    for _ in range(MAX_ATTEMPTS):
        recover(recovery, robot, behind)
        assert robot.pose.x > -0.02


def test_walled_in_robot_waits_and_attempts_are_bounded() -> None:
    recovery, robot = Recovery(), Robot(Pose2D(0.0, 0.0, 0.0), [])
    for _ in range(MAX_ATTEMPTS):
        assert not recovery.exhausted
        recover(recovery, robot, ring(0.24))
        robot.time += 0.05
    assert recovery.exhausted
    assert robot.pose == Pose2D(0.0, 0.0, 0.0)
    assert robot.twist == Twist2D()


def test_new_trouble_elsewhere_has_all_attempts_again() -> None:
    recovery, robot = Recovery(), Robot(Pose2D(0.0, 0.0, 0.0), [])
    recover(recovery, robot, NOTHING)
    recovery.watch(Pose2D(0.2, 0.0, 0.0))
    assert recovery.attempts == 1
    recovery.watch(Pose2D(1.0, 0.0, 0.0))
    assert recovery.attempts == 0
    assert recovery.total == 1
