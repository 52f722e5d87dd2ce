"""Promises of battery, lighting and reflection."""

from dataclasses import fields

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import Diagnostic, Level, SensorFault, SensorHealth, SystemStatus
from regraft.bus_schema.messages.power import BatteryState, ChargerState, EnergyUse, PowerDraw
from regraft.bus_schema.messages.sensors import LightLevel, Odometry
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.services.battery import Battery
from regraft.services.lighting import Lighting, darkness_at
from regraft.services.power_model import motion_power, total_power
from regraft.services.system_status import SystemStatusReporter
from regraft.testing import Rig

from .rigs import disconnect, set_parameters


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


def test_battery_draws_what_the_robots_parts_draw() -> None:
    parts = {"motion_power": [1.0, 10.0], "consumers": [{"name": "arm", "power": 2.5}]}
    with Rig() as rig:
        rig.add(Battery, parameters=parts)
        draws = rig.collect("power", PowerDraw)
        moving(rig, 0.1)
        rig.advance(2.0)
    assert draws[-1].consumers == pytest.approx({"motion": 2.0, "arm": 2.5})
    estimate = Battery.estimate({"capacity": 450.0, **parts}, {"speed": 0.1})
    assert (estimate["power"], estimate["endurance"]) == pytest.approx((4.5, 100.0))


def test_a_fault_drains_the_battery_by_hand_and_by_the_clock() -> None:
    parts = {"motion_power": [0.0], "consumers": [], "drains": [{"at": 2.0, "power": 50.0}, {"at": 4.0, "power": 0.0}]}
    with Rig() as rig:
        rig.add(Battery, parameters=parts)
        states, draws = rig.collect("battery", BatteryState), rig.collect("power", PowerDraw)
        rig.advance(6.0)
        assert draws[-1].consumers == {"motion": 0.0}
        assert 20_000.0 - states[-1].energy == pytest.approx(100.0, abs=25.0)
        set_parameters(rig, "battery", drain=10.0)
        rig.advance(2.0)
        assert draws[-1].consumers == {"motion": 0.0, "drain": 10.0}


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
    assert told == ["battery.below_limit", "battery.low", "battery.empty"]
    assert states[-1].energy == 0.0
    assert states[-1].charge == 0.0


def test_a_restored_battery_is_no_fuller_and_pays_for_the_time_between() -> None:
    with Rig() as rig:
        battery = rig.add(Battery)
        rig.advance(10.0)
        state = battery.snapshot()
    with Rig(start=12.0) as rig:
        successor = rig.add(Battery, state=State.INACTIVE)
        successor.restore(state)
        rig.transition("battery", Transition.ACTIVATE)
        states = rig.collect("battery", BatteryState)
        rig.advance(1.0)
    assert states[-1].energy == pytest.approx(20_000.0 - 13.0 * 7.14)


def test_an_inactive_battery_is_not_drawn_from() -> None:
    with Rig() as rig:
        rig.add(Battery)
        rig.advance(1.0)
        rig.transition("battery", Transition.DEACTIVATE)
        rig.advance(10.0)
        rig.transition("battery", Transition.ACTIVATE)
        states = rig.collect("battery", BatteryState)
        rig.advance(1.0)
    assert states[-1].energy == pytest.approx(20_000.0 - 2.0 * 7.14)


def test_all_consumers_of_one_name_are_drawn() -> None:
    consumers = [{"name": name, "power": power} for name, power in (("camera", 2.0), ("camera", 3.0), ("motion", 5.0))]
    with Rig() as rig:
        rig.add(Battery, parameters={"motion_power": [10.0], "consumers": consumers})
        draws = rig.collect("power", PowerDraw)
        rig.advance(2.0)
    assert draws[-1].consumers == pytest.approx({"motion": 15.0, "camera": 5.0})


def charging(rig: Rig, connected: bool, seconds: float, power: float = 20.0) -> None:
    """Let the charger speak twice a second, as the world does."""
    for _ in range(round(2 * seconds)):
        rig.advance(0.5)
        rig.publish("charger", ChargerState(rig.clock.now() / 1e9, connected, power if connected else 0.0))


def test_a_charger_fills_the_battery_net_of_what_is_drawn() -> None:
    with Rig() as rig:
        rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.5})
        states = rig.collect("battery", BatteryState)
        charging(rig, connected=True, seconds=10.5)
        rig.advance(0.5)
    # The charger's first word comes half a second after the battery began to draw.
    assert states[-1].energy == pytest.approx(1000.0 + 10.5 * 20.0 - 11.0 * 7.14)
    assert states[-1].power == pytest.approx(7.14)


def test_a_full_battery_takes_no_more_than_is_drawn() -> None:
    with Rig() as rig:
        battery = rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.99})
        states = rig.collect("battery", BatteryState)
        charging(rig, connected=True, seconds=20.0)
        before = battery.evaluate()
        charging(rig, connected=True, seconds=5.0)
        after = battery.evaluate()
    assert states[-1].energy == 2000.0
    assert states[-1].charge == 1.0
    assert after["charged"] - before["charged"] == pytest.approx(5.0 * 7.14)


def test_a_charger_that_falls_silent_charges_no_more() -> None:
    with Rig() as rig:
        rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.5})
        states = rig.collect("battery", BatteryState)
        rig.publish("charger", ChargerState(0.0, True, 20.0))
        rig.advance(10.0)
        told = [event.kind for event in rig.events]
    assert states[-1].energy == pytest.approx(1000.0 + 2.0 * 20.0 - 10.0 * 7.14)
    assert told[-2:] == ["battery.charging", "battery.unplugged"]


def test_a_charger_that_the_robot_does_not_stand_on_charges_nothing() -> None:
    with Rig() as rig:
        battery = rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.5, "limit": 0.0})
        rig.publish("charger", ChargerState(0.0, False, 20.0))
        rig.advance(1.0)
        assert battery.evaluate()["charged"] == 0.0
        assert [event.kind for event in rig.events if event.kind.startswith("battery.")] == []


@pytest.mark.parametrize(
    ("message", "field"),
    [(EnergyUse(0.0, "detector", -1e6), "energy"), (ChargerState(0.0, True, -20.0), "power")],
)
def test_what_would_be_negative_is_refused_by_its_field(message: EnergyUse | ChargerState, field: str) -> None:
    plain = {each.name: getattr(message, each.name) for each in fields(message)}
    with pytest.raises(BadMessage) as sent:
        codec.encode(message)
    with pytest.raises(BadMessage) as received:
        codec.decode(codec.pack_plain(plain), type(message))
    assert sent.value.where == received.value.where == (field,)


def test_the_battery_asks_below_its_limit_and_is_content_when_recharged() -> None:
    diagnostics: list[Diagnostic] = []
    charge_when: dict[str, float] = {}
    with Rig() as rig:
        rig.bus.subscribe(rig.keys.diagnostics, lambda s: diagnostics.append(codec.decode(s.payload, Diagnostic)))
        rig.add(Battery, parameters={"capacity": 2000.0})
        rig.advance(40.0)
        charging(rig, connected=True, seconds=40.0)
        for event in rig.events:
            charge_when.setdefault(event.kind, event.details.get("charge", 0.0))
    assert charge_when["battery.below_limit"] == pytest.approx(0.9, abs=0.002)
    assert charge_when["battery.ok"] == pytest.approx(0.98, abs=0.005)
    assert [d.level for d in diagnostics if d.subject == "battery"] == [Level.WARNING, Level.OK]


uses = st.one_of(
    st.tuples(st.just("drive"), st.floats(-0.26, 0.26)),
    st.tuples(st.just("charger"), st.floats(0.0, 60.0)),
    st.tuples(st.just("use"), st.floats(0.0, 300.0)),
    st.tuples(st.just("wait"), st.floats(0.01, 3.0).map(lambda seconds: round(seconds, 2))),
)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.0, 1.0), st.lists(uses, max_size=25))
def test_no_energy_comes_from_nowhere_and_none_is_lost(initial: float, story: list[tuple[str, float]]) -> None:
    with Rig() as rig:
        battery = rig.add(Battery, parameters={"capacity": 500.0, "initial_charge": initial})
        states = rig.collect("battery", BatteryState)
        for what, value in story:
            now = rig.clock.now() / 1e9
            if what == "drive":
                moving(rig, value)
            elif what == "charger":
                rig.publish("charger", ChargerState(now, value > 0.0, value))
            elif what == "use":
                rig.publish("energy", EnergyUse(now, "detector", value))
            else:
                rig.advance(value)
        rig.advance(1.0)
        account = battery.evaluate()
    assert all(0.0 <= state.energy <= 500.0 for state in states)
    left = 500.0 * initial + account["charged"] - account["drawn"]
    assert states[-1].energy == pytest.approx(left, abs=1e-6)


def test_a_battery_that_is_swapped_while_charging_goes_on_charging() -> None:
    with Rig() as rig:
        battery = rig.add(Battery, parameters={"capacity": 2000.0, "initial_charge": 0.5})
        charging(rig, connected=True, seconds=5.0)
        state = codec.unpack_plain(codec.encode(rig.runtimes["battery"].checkpoints.snapshot()))["state"]
        drawn = battery.evaluate()["drawn"]
    with Rig(start=5.0) as rig:
        successor = rig.add(Battery, parameters={"capacity": 2000.0})
        successor.restore(state)
        states = rig.collect("battery", BatteryState)
        rig.advance(1.0)
        assert successor.evaluate()["drawn"] == pytest.approx(drawn + 7.14)
        assert states[-1].energy == pytest.approx(1000.0 + 5.5 * 20.0 - 6.0 * 7.14)
        rig.advance(3.0)
        changes = [event.kind for event in rig.events if event.kind in ("battery.charging", "battery.unplugged")]
    assert changes == ["battery.unplugged"]


@pytest.mark.parametrize("speed", [0.0, 0.1, 0.26])
def test_the_battery_lasts_as_long_as_it_was_estimated_to(speed: float) -> None:
    estimate = Battery.estimate({"capacity": 300.0}, {"speed": speed})
    with Rig() as rig:
        rig.add(Battery, parameters={"capacity": 300.0})
        moving(rig, speed)
        rig.advance(60.0)
        told = {event.kind: event.stamp for event in rig.events}
    assert told["battery.empty"] == pytest.approx(estimate["endurance"], abs=0.5)
    assert told["battery.below_limit"] == pytest.approx(estimate["time_to_limit"], abs=0.5)
    assert estimate["endurance"] == pytest.approx(300.0 / total_power(speed))


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
        rig.add(SystemStatusReporter)
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


def test_reflection_names_what_is_wrong_with_the_sensors() -> None:
    with Rig() as rig:
        rig.add(SystemStatusReporter)
        statuses = rig.collect("system_status", SystemStatus)
        faults = (SensorFault("camera/image", "black", "the pictures are black", 0.0),)
        rig.publish("sensor_health", SensorHealth(0.5, ("camera/image", "scan"), faults))
        rig.advance(1.0)
        assert list(statuses[-1].problems) == ["camera/image black"]
        rig.publish("sensor_health", SensorHealth(1.5, ("camera/image", "scan")))
        rig.advance(1.0)
        assert not statuses[-1].problems
        rig.advance(5.0)
    assert statuses[-1].problems == ("no word of the sensors for 6 s",)


def test_reflection_misses_no_word_of_what_is_disconnected() -> None:
    with Rig() as rig:
        rig.add(SystemStatusReporter)
        statuses = rig.collect("system_status", SystemStatus)
        rig.publish("battery", BatteryState(0.0, 19_000.0, 20_000.0, 0.95, 7.0))
        rig.publish("light", LightLevel(0.0, 0.3))
        rig.publish("sensor_health", SensorHealth(0.5, ("camera/image", "scan")))
        rig.advance(1.0)
        for port in ("battery", "light", "sensor_health"):
            disconnect(rig, "systemstatusreporter", port)
        rig.advance(5.0)
    assert statuses[-1].charge is statuses[-1].darkness is None
    assert not statuses[-1].problems
