"""Promises about schedules of failures, and what failures do to readings."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from regraft.sim_service.robot.failures import (
    CameraFails,
    CameraFailure,
    OdometryFails,
    OdometryFailure,
    ScanFails,
    ScanFailure,
    Schedule,
    ScheduleError,
    drop_rays,
)
from regraft.sim_service.robot.odometry import Drift, OdometrySettings

from regraft.sim_service.simulation import Simulation, SimulationSettings

from .worlds import drive, frog_with_robot_at

times = st.floats(0.0, 1000.0).map(lambda time: round(time, 3))
entries = st.builds(ScanFails, times, st.sampled_from(ScanFailure))


def test_a_sensor_fails_from_its_time_until_the_next() -> None:
    schedule = Schedule((CameraFails(30.0, CameraFailure.BLACK), CameraFails(60.0, CameraFailure.NONE)))
    assert [schedule.at(time) for time in (0.0, 29.9, 30.0, 59.9, 60.0, 1e6)] == [
        *("none", "none", "black", "black"),
        *("none", "none"),
    ]


@given(st.lists(entries), st.floats(0.0, 1000.0))
def test_the_last_entry_up_to_now_holds(given_entries: list[ScanFails], now: float) -> None:
    ordered = sorted(given_entries, key=lambda entry: entry.at)
    past = [entry.failure.value for entry in ordered if entry.at <= now + 1e-6]
    assert Schedule(ordered).at(now) == ([*["none"], *past][-1])


def test_entries_out_of_order_are_refused() -> None:
    entries = (OdometryFails(30.0, OdometryFailure.DRIFT), OdometryFails(20.0, OdometryFailure.NONE))
    with pytest.raises(ScheduleError, match=r"failures\.1: 20 s comes after 30 s: put the entries in order"):
        Schedule(entries)


def test_a_dropout_loses_its_share_of_the_rays_and_changes_no_other() -> None:
    ranges = np.linspace(0.2, 3.4, 3600)
    left = drop_rays(ranges, 0.3, seed=1, moment=7)
    lost = np.isinf(left)
    assert lost.mean() == pytest.approx(0.3, abs=0.03)
    np.testing.assert_array_equal(left[~lost], ranges[~lost])
    np.testing.assert_array_equal(left, drop_rays(ranges, 0.3, seed=1, moment=7))
    assert (left != drop_rays(ranges, 0.3, seed=1, moment=8)).any()


def wandered(settings: OdometrySettings) -> Simulation:
    """Drive a metre and turn half round, with an odometry of this quality."""
    simulation = frog_with_robot_at(0.0, -1.0, 0.0, SimulationSettings(odometry=settings))
    drive(simulation, 0.25, 0.0, 4.0)
    drive(simulation, 0.0, 1.0, 3.0)
    return simulation


def test_wheels_taken_for_too_large_make_the_way_too_long() -> None:
    exact, wrong = wandered(OdometrySettings()), wandered(OdometrySettings(radius_error=0.05))
    assert wrong.odometry().pose.x == pytest.approx(1.05 * exact.odometry().pose.x, rel=0.01)
    assert exact.odometry().pose.x == pytest.approx(exact.ground_truth().pose.x, abs=0.01)


def test_wheels_taken_for_too_far_apart_make_turns_too_small() -> None:
    exact, wrong = wandered(OdometrySettings()), wandered(OdometrySettings(track_error=0.1))
    assert wrong.odometry().pose.yaw == pytest.approx(exact.odometry().pose.yaw / 1.1, rel=0.02)


def test_a_right_wheel_taken_for_larger_bends_the_way_to_the_left() -> None:
    simulation = frog_with_robot_at(
        0.0, -1.0, 0.0, SimulationSettings(odometry=OdometrySettings(radius_difference=0.01))
    )
    drive(simulation, 0.25, 0.0, 4.0)
    travelled = simulation.ground_truth().pose.x
    assert simulation.odometry().pose.yaw == pytest.approx(0.01 * travelled / 0.287, rel=0.1)
    assert abs(simulation.ground_truth().pose.yaw) < 0.01


def test_a_drift_spoils_the_odometry_while_it_lasts_and_its_error_stays() -> None:
    simulation = frog_with_robot_at(0.0, -1.0, 0.0)
    drive(simulation, 0.25, 0.0, 1.0)
    before = simulation.odometry().pose
    simulation.spoil_odometry(Drift(yaw_per_metre=0.4))
    drive(simulation, 0.25, 0.0, 2.0)
    spoilt = simulation.odometry().pose
    travelled = math.hypot(spoilt.x - before.x, spoilt.y - before.y)
    assert spoilt.yaw - before.yaw == pytest.approx(0.4 * travelled, rel=0.05)
    simulation.spoil_odometry(Drift())
    drive(simulation, 0.25, 0.0, 1.0)
    assert simulation.odometry().pose.yaw == pytest.approx(spoilt.yaw, abs=0.01)
    assert abs(simulation.ground_truth().pose.yaw) < 0.01
