"""Promises about schedules of failures, and what failures do to readings."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.sim_service.robot.failures import (
    CAMERA_FAILURES,
    ODOMETRY_FAILURES,
    SCAN_FAILURES,
    ScheduleError,
    drop_rays,
    parse_schedule,
)
from regraft.sim_service.robot.odometry import Drift, OdometrySettings
from regraft.sim_service.simulation import Simulation, SimulationSettings

from .worlds import drive, frog_with_robot_at

CAMERA = {"image": CAMERA_FAILURES}
WORLD = {"scan": SCAN_FAILURES, "odometry": ODOMETRY_FAILURES}

entries = st.tuples(
    st.floats(0.0, 1000.0).map(lambda time: round(time, 3)),
    st.sampled_from([(sensor, failure) for sensor, failures in WORLD.items() for failure in failures]),
)


def test_a_sensor_fails_from_its_time_until_the_next() -> None:
    schedule = parse_schedule("30 black, 60 none", CAMERA)
    assert [schedule.at("image", time) for time in (0.0, 29.9, 30.0, 59.9, 60.0, 1e6)] == [
        *("none", "none", "black", "black"),
        *("none", "none"),
    ]


def test_the_sensors_of_one_component_fail_independently() -> None:
    schedule = parse_schedule("1 scan silent, 2 odometry drift, 3 scan none", WORLD)
    assert (schedule.at("scan", 2.5), schedule.at("odometry", 2.5)) == ("silent", "drift")
    assert (schedule.at("scan", 3.5), schedule.at("odometry", 3.5)) == ("none", "drift")


@given(st.lists(entries), st.floats(0.0, 1000.0))
def test_the_last_entry_up_to_now_holds(given_entries: list[tuple[float, tuple[str, str]]], now: float) -> None:
    ordered = sorted(given_entries, key=lambda entry: entry[0])
    text = ", ".join(f"{time} {sensor} {failure}" for time, (sensor, failure) in ordered)
    schedule = parse_schedule(text, WORLD)
    for sensor in WORLD:
        past = [failure for time, (name, failure) in ordered if name == sensor and time <= now + 1e-6]
        assert schedule.at(sensor, now) == ([*["none"], *past][-1])


@pytest.mark.parametrize(
    ("text", "failures", "complaint"),
    [
        ("soon black", CAMERA, r"failures: 'soon black' must begin with seconds of simulated time, as in '30 black'"),
        ("-1 black", CAMERA, "must begin with seconds"),
        ("nan black", CAMERA, "must begin with seconds"),
        ("30 blind", CAMERA, "failures: '30 blind' must end with one of: none, black, frozen, silent"),
        ("30", CAMERA, "failures: '30' must read '30 black'"),
        ("30 silent", WORLD, "failures: '30 silent' must read '30 scan silent'"),
        ("30 nose silent", WORLD, "failures: '30 nose silent' names no sensor; there are: scan, odometry"),
        ("30 scan drift", WORLD, "must end with one of: none, silent, frozen, dropout"),
        ("30 black, 20 none", CAMERA, "failures: '20 none' comes after 30 s: put the entries in order"),
    ],
)
def test_a_bad_schedule_is_refused_naming_the_part_and_what_is_right(
    text: str, failures: dict[str, tuple[str, ...]], complaint: str
) -> None:
    with pytest.raises(ScheduleError, match=complaint):
        parse_schedule(text, failures)


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
