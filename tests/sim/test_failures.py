"""Promises about schedules of failures, and what failures do to readings."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.sim_service.devices.core.failure_schedule import (
    DROPOUT,
    CameraFails,
    CameraFailure,
    DeviceFails,
    Schedule,
)
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.simulation import Simulation
from tests.support.worlds import odometry_of, set_drift, truth_of

from .worlds import drive, frog_with_robot_at

times = st.floats(0.0, 1000.0).map(lambda time: round(time, 3))
entries = st.builds(DeviceFails, times, st.just("scan"), st.sampled_from(("none", "silent", "frozen", "dropout")))


def test_a_sensor_fails_from_its_time_until_the_next() -> None:
    schedule = Schedule((CameraFails(30.0, CameraFailure.BLACK), CameraFails(60.0, CameraFailure.NONE)))
    assert [schedule.at(time) for time in (0.0, 29.9, 30.0, 59.9, 60.0, 1e6)] == [
        *("none", "none", "black", "black"),
        *("none", "none"),
    ]


@given(st.lists(entries), st.floats(0.0, 1000.0))
def test_the_last_entry_up_to_now_holds(given_entries: list[DeviceFails], now: float) -> None:
    ordered = sorted(given_entries, key=lambda entry: entry.at)
    past = [entry.failure for entry in ordered if entry.at <= now + 1e-6]
    assert Schedule(ordered).at(now) == ([*["none"], *past][-1])


def test_a_dropout_loses_its_share_of_the_rays_and_changes_no_other() -> None:
    simulation = frog_with_robot_at(0.0, -1.0, 0.0, scan={"beams": 3600, "dropout": 0.3, "range_max": 6.0})
    lidar = simulation.robot().device("scan", Lidar)
    whole = lidar.measure().ranges
    lidar.kit.failing = DROPOUT
    left = lidar.measure().ranges
    lost = np.isinf(left) & np.isfinite(whole)
    assert lost.sum() / np.isfinite(whole).sum() == pytest.approx(0.3, abs=0.03)
    np.testing.assert_array_equal(left[np.isfinite(left)], whole[np.isfinite(left)])
    np.testing.assert_array_equal(left, lidar.measure().ranges)
    simulation.advance(simulation.settings.tick)
    assert (np.isinf(lidar.measure().ranges) != np.isinf(left)).any()


def wandered(**odometry: float) -> Simulation:
    """Drive a metre and turn half round, with an odometry of this quality."""
    simulation = frog_with_robot_at(0.0, -1.0, 0.0, odometry=odometry)
    drive(simulation, 0.25, 0.0, 4.0)
    drive(simulation, 0.0, 1.0, 3.0)
    return simulation


def test_wheels_taken_for_too_large_make_the_way_too_long() -> None:
    exact, wrong = wandered(), wandered(radius_error=0.05)
    assert odometry_of(wrong).pose.x == pytest.approx(1.05 * odometry_of(exact).pose.x, rel=0.01)
    assert odometry_of(exact).pose.x == pytest.approx(truth_of(exact).pose.x, abs=0.01)


def test_wheels_taken_for_too_far_apart_make_turns_too_small() -> None:
    exact, wrong = wandered(), wandered(track_error=0.1)
    assert odometry_of(wrong).pose.yaw == pytest.approx(odometry_of(exact).pose.yaw / 1.1, rel=0.02)


def test_a_right_wheel_taken_for_larger_bends_the_way_to_the_left() -> None:
    simulation = frog_with_robot_at(0.0, -1.0, 0.0, odometry={"radius_difference": 0.01})
    drive(simulation, 0.25, 0.0, 4.0)
    travelled = truth_of(simulation).pose.x
    assert odometry_of(simulation).pose.yaw == pytest.approx(0.01 * travelled / 0.287, rel=0.1)
    assert abs(truth_of(simulation).pose.yaw) < 0.01


def test_a_drift_spoils_the_odometry_while_it_lasts_and_its_error_stays() -> None:
    simulation = frog_with_robot_at(0.0, -1.0, 0.0, odometry={"drift_yaw": 0.4, "drift_scale": 0.0})
    drive(simulation, 0.25, 0.0, 1.0)
    before = odometry_of(simulation).pose
    set_drift(simulation, lasts=True)
    drive(simulation, 0.25, 0.0, 2.0)
    spoilt = odometry_of(simulation).pose
    travelled = math.hypot(spoilt.x - before.x, spoilt.y - before.y)
    assert spoilt.yaw - before.yaw == pytest.approx(0.4 * travelled, rel=0.05)
    set_drift(simulation, lasts=False)
    drive(simulation, 0.25, 0.0, 1.0)
    assert odometry_of(simulation).pose.yaw == pytest.approx(spoilt.yaw, abs=0.01)
    assert abs(truth_of(simulation).pose.yaw) < 0.01
