"""Promises of battery, lighting and reflection."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bus_schema.messages.geometry import Pose, Twist
from bus_schema.messages.health import SystemStatus
from bus_schema.messages.power import BatteryState, EnergyUse, PowerDraw
from bus_schema.messages.sensors import LightLevel, Odometry
from regraft.testing import Rig
from services.battery import Battery
from services.lighting import Lighting, darkness_at
from services.power_model import motion_power
from services.reflection import Reflection


def moving(rig: Rig, speed: float) -> None:
    """Say that the robot moves at a speed from now on."""
    now = rig.clock.now() / 1e9
    rig.publish("odometry", Odometry(now, "odom", "base_link", Pose(), Twist.planar(speed, 0.0)))


def test_motion_power_is_that_of_frog() -> None:
    assert motion_power(0.0) == pytest.approx(3.66)
    assert motion_power(0.10) == pytest.approx(4.70, abs=0.01)
    assert motion_power(0.18) == pytest.approx(5.62, abs=0.01)
    assert motion_power(-0.26) == motion_power(0.26) == pytest.approx(6.63, abs=0.01)


def test_battery_draws_for_standing_lidar_and_idling() -> None:
    with Rig() as rig:
        rig.add(Battery)
        states, draws = rig.collect("battery", BatteryState), rig.collect("power", PowerDraw)
        rig.advance(10.0)
    assert len(states) == 20
    assert states[-1].energy == pytest.approx(20_000.0 - 10.0 * (3.66 + 2.34 + 1.14))
    assert states[-1].power == pytest.approx(7.14)
    assert draws[-1].consumers == pytest.approx({"motion": 3.66, "lidar": 2.34, "idle": 1.14})


def test_battery_integrates_over_every_change_of_speed() -> None:
    with Rig() as rig:
        rig.add(Battery)
        states = rig.collect("battery", BatteryState)
        for speed, seconds in ((0.26, 1.25), (0.1, 0.35), (0.0, 2.4)):
            moving(rig, speed)
            rig.advance(seconds)
    expected = 1.25 * motion_power(0.26) + 0.35 * motion_power(0.1) + 2.4 * motion_power(0.0) + 4.0 * 3.48
    assert 20_000.0 - states[-1].energy == pytest.approx(expected)


def test_battery_books_what_is_taken_at_once() -> None:
    with Rig() as rig:
        rig.add(Battery)
        states, draws = rig.collect("battery", BatteryState), rig.collect("power", PowerDraw)
        rig.publish("energy", EnergyUse(0.0, "detector", 59.275))
        rig.publish("energy", EnergyUse(0.1, "detector", 59.275))
        rig.advance(1.0)
    assert states[-1].energy == pytest.approx(20_000.0 - 7.14 - 2 * 59.275)
    assert draws[0].consumers["detector"] == pytest.approx(4 * 59.275)
    assert "detector" not in draws[1].consumers


def test_a_low_and_an_empty_battery_are_told_once() -> None:
    with Rig() as rig:
        rig.add(Battery, parameters={"capacity": 100.0})
        states = rig.collect("battery", BatteryState)
        rig.advance(30.0)
        told = [event.kind for event in rig.events if event.kind.startswith("battery.")]
    assert told == ["battery.low", "battery.empty"]
    assert states[-1].energy == 0.0
    assert states[-1].charge == 0.0


def test_a_restored_battery_is_no_fuller_and_pays_for_the_time_between() -> None:
    with Rig() as rig:
        battery = rig.add(Battery)
        rig.advance(10.0)
        state = battery.snapshot()
    with Rig(start=12.0) as rig:
        successor = rig.add(Battery)
        successor.restore(state)
        states = rig.collect("battery", BatteryState)
        rig.advance(1.0)
    assert states[-1].energy == pytest.approx(20_000.0 - 13.0 * 7.14)


@settings(deadline=None)
@given(st.floats(0.0, 1e6), st.floats(1.0, 1e4), st.floats(-1e3, 1e3), st.floats(0.0, 1.0))
def test_darkness_stays_within_its_bounds(time: float, period: float, phase: float, darkest: float) -> None:
    assert 0.0 <= darkness_at(time, period, phase, darkest) <= darkest


def test_light_comes_and_goes_as_in_frog() -> None:
    with Rig() as rig:
        rig.add(Lighting)
        levels = rig.collect("light", LightLevel)
        rig.advance(167.0)
    assert len(levels) == 334
    assert levels[0].stamp == 0.5
    # Begun 51.8 s past the middle, it is past the darkest, and lightest a half period after the darkest.
    assert levels[0].darkness == pytest.approx(darkness_at(0.5, 1 / 0.006, 51.8))
    assert levels[0].darkness > 0.9
    lightest = min(levels, key=lambda level: level.darkness)
    assert lightest.stamp == pytest.approx(0.75 / 0.006 - 51.8, abs=0.5)
    share_dark = sum(level.darkness > 0.7 for level in levels) / len(levels)
    assert share_dark == pytest.approx(0.37, abs=0.01)


def test_the_light_can_be_kept_on() -> None:
    with Rig() as rig:
        rig.add(Lighting, parameters={"darkest": 0.0})
        levels = rig.collect("light", LightLevel)
        rig.advance(50.0)
    assert {level.darkness for level in levels} == {0.0}


def test_reflection_puts_together_charge_and_darkness_and_names_problems() -> None:
    with Rig() as rig:
        rig.add(Reflection)
        statuses = rig.collect("system_status", SystemStatus)
        rig.publish("battery", BatteryState(0.0, 19_000.0, 20_000.0, 0.95, 7.0))
        rig.publish("light", LightLevel(0.0, 0.3))
        rig.advance(1.0)
        assert (statuses[-1].charge, statuses[-1].darkness) == (0.95, 0.3)
        assert not statuses[-1].problems
        rig.publish("battery", BatteryState(1.0, 2_000.0, 20_000.0, 0.1, 7.0))
        rig.publish("light", LightLevel(1.0, 0.9))
        rig.advance(1.0)
        assert statuses[-1].problems == ("battery at 10%", "darkness 90%")
        rig.advance(5.0)
    assert statuses[-1].charge is None
    assert statuses[-1].problems == (
        "no word from the battery for 6 s",
        "no word of the light for 6 s",
    )
