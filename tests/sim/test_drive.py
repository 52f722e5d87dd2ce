"""Promises about driving and odometry."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.sim_service.devices.drive import DifferentialDrive
from tests.support.worlds import new_contacts, odometry_of, send_command, touched_by, truth_of

from .worlds import drive, frog_with_robot_at

DRIVE = frog_with_robot_at(0.0, 0.0, 0.0).robot().device("drive", DifferentialDrive)
SEGMENTS = [(0.26, 0.0, 4), (0.0, 1.82, 3), (0.2, 0.5, 4), (0.0, -1.0, 2), (-0.15, 0.0, 2), (0.1, 1.0, 2)]
"""Forward velocity (m/s), yaw rate (rad/s) and duration (s): 17 s with about 11 rad of turning."""


def test_odometry_agrees_with_truth_within_a_centimetre_after_17_s_of_driving() -> None:
    simulation = frog_with_robot_at(-0.9, -1.0, 0.2)
    for v, w, seconds in SEGMENTS:
        drive(simulation, v, w, seconds)
    truth, odometry = truth_of(simulation).pose, odometry_of(simulation).pose
    assert new_contacts(simulation) == ()
    assert math.hypot(truth.x - odometry.x, truth.y - odometry.y) < 0.01
    assert abs(truth.yaw - odometry.yaw) < math.radians(1.0)


@pytest.mark.parametrize(("v", "w"), [(0.26, 0.0), (-0.15, 0.0), (0.0, 1.0), (0.15, -0.5)])
def test_robot_moves_as_commanded(v: float, w: float) -> None:
    simulation = frog_with_robot_at(-0.5, -0.9, 0.0)
    drive(simulation, v, w, 1.0)
    start = truth_of(simulation).pose
    drive(simulation, v, w, 1.0)
    truth, odometry = truth_of(simulation), odometry_of(simulation)
    assert math.hypot(truth.pose.x - start.x, truth.pose.y - start.y) == pytest.approx(
        abs(v) if w == 0.0 else abs(2.0 * v / w * math.sin(w / 2.0)), abs=0.01
    )
    assert truth.twist.v == pytest.approx(v, abs=0.01)
    assert truth.twist.w == pytest.approx(w, abs=0.02)
    assert odometry.twist.v == pytest.approx(v, abs=0.005)
    assert odometry.twist.w == pytest.approx(w, abs=0.01)


@given(v=st.floats(-2.0, 2.0), w=st.floats(-10.0, 10.0))
def test_saturation_keeps_the_curvature(v: float, w: float) -> None:
    left, right = DRIVE.wheel_speeds(v, w)
    assert max(abs(left), abs(right)) <= 8.2 + 1e-9
    reached_v = (left + right) / 2.0 * DRIVE.wheel_radius
    reached_w = (right - left) / DRIVE.track * DRIVE.wheel_radius
    assert reached_v * w == pytest.approx(reached_w * v, abs=1e-9)
    assert reached_v * v >= 0.0
    assert abs(reached_v) <= abs(v) + 1e-12


@pytest.mark.parametrize(("v", "w"), [(1e308, 0.0), (1e308, -1e308), (-1e308, 1e307), (0.0, 1.7e308)])
def test_a_twist_whose_wheel_speeds_no_number_can_hold_is_slowed_like_any_other(v: float, w: float) -> None:
    assert DRIVE.wheel_speeds(v, w) == pytest.approx(DRIVE.wheel_speeds(v * 1e-300, w * 1e-300))


@given(v=st.floats(-0.13, 0.13), w=st.floats(-0.9, 0.9))
def test_reachable_twists_are_not_changed(v: float, w: float) -> None:
    left, right = DRIVE.wheel_speeds(v, w)
    assert (left + right) / 2.0 * DRIVE.wheel_radius == pytest.approx(v, abs=1e-12)
    assert (right - left) / DRIVE.track * DRIVE.wheel_radius == pytest.approx(w, abs=1e-12)


def test_robot_stops_when_commands_stay_away() -> None:
    simulation = frog_with_robot_at(-0.5, -0.9, 0.0)
    send_command(simulation, 0.2, 0.0)
    simulation.advance(0.4)
    assert truth_of(simulation).twist.v > 0.15
    simulation.advance(0.6)
    assert truth_of(simulation).twist.v == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_command_that_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        send_command(frog_with_robot_at(0.0, 0.0, 0.0), bad, 0.0)


def test_odometry_starts_at_zero_when_told_so() -> None:
    simulation = frog_with_robot_at(-0.5, -0.9, 0.7, odometry={"at_start_pose": False})
    drive(simulation, 0.2, 0.0, 1.0)
    pose = odometry_of(simulation).pose
    assert pose.x == pytest.approx(0.2, abs=0.02)
    assert (pose.y, pose.yaw) == pytest.approx((0.0, 0.0), abs=1e-3)


def test_noisy_odometry_drifts_the_same_way_for_the_same_seed() -> None:
    noisy = {"travel_noise": 0.05}
    runs = [frog_with_robot_at(-0.9, -1.0, 0.2, odometry=noisy) for _ in range(2)]
    for simulation in runs:
        drive(simulation, 0.2, 0.0, 4.0)
    truth = truth_of(runs[0]).pose
    poses = [odometry_of(simulation).pose for simulation in runs]
    assert poses[0] == poses[1]
    assert math.hypot(truth.x - poses[0].x, truth.y - poses[0].y) > 0.01


def test_robot_pushing_a_wall_neither_tips_nor_passes_through_it() -> None:
    simulation = frog_with_robot_at(2.0, -0.5, 0.0)
    drive(simulation, 0.26, 0.0, 20.0)
    assert touched_by(simulation) == {"walls"}
    assert truth_of(simulation).pose.x + 0.069 < 2.36
