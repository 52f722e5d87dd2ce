"""Promises of the sensor monitor over a restart, and over an inactive time: what has failed has not become well."""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import SensorHealth
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.services.sensor_monitor import SensorMonitor
from regraft.testing import Rig

Depths = npt.NDArray[np.float32]


def keep_sending(rig: Rig, seconds: float, ranges: Callable[[], Depths] | None) -> None:
    """Send ten scans a second that go all around, or none."""
    for _ in range(round(seconds / 0.1)):
        rig.advance(0.1)
        if ranges is not None:
            now = rig.clock.now() / 1e9
            rig.publish("scan", LaserScan(now, "lidar", "base_link", Pose(), 0.0, math.tau / 90, 0.1, 8.0, ranges()))


def kept(rig: Rig) -> PlainValue:
    """Return the state of the monitor's last checkpoint, as a further run gets it."""
    return codec.unpack_plain(codec.encode(rig.runtimes["sensormonitor"].checkpoints.snapshot()))["state"]


NOISE = np.random.default_rng(1)


def working() -> Depths:
    """Return the ranges of a lidar that works."""
    return NOISE.uniform(1.0, 4.0, 90).astype(np.float32)


ENDS: dict[str, tuple[Callable[[], Depths] | None, list[str]]] = {
    "frozen": (lambda: np.full(90, 2.0, np.float32), ["sensor.frozen", "sensor.ok"]),
    "silent": (None, ["sensor.silent", "sensor.ok"]),
    "blind": (lambda: np.where(np.arange(90) < 5, working(), np.inf).astype(np.float32), ["sensor.blind", "sensor.ok"]),
}


@pytest.mark.parametrize("expected", [["scan"], []])
@pytest.mark.parametrize("fault", ENDS)
def test_a_failed_sensor_is_reported_over_a_restart_of_the_monitor_until_it_is_well(
    fault: str, expected: list[str]
) -> None:
    failing, kinds = ENDS[fault]
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": expected})
        keep_sending(rig, 2.0, working)
        keep_sending(rig, 4.0, failing)
        state = kept(rig)
        told = [event.kind for event in rig.events if event.kind.startswith("sensor.")]
    with Rig(start=6.5) as rig:
        monitor = rig.add(SensorMonitor, parameters={"expected": expected}, state=State.INACTIVE)
        monitor.restore(state)
        rig.transition("sensormonitor", Transition.ACTIVATE)
        health = rig.collect("sensor_health", SensorHealth)
        keep_sending(rig, 9.0, failing)
        assert [[(each.topic, each.fault) for each in report.faults] for report in health] == [[("scan", fault)]] * 18
        keep_sending(rig, 2.0, working)
        assert not health[-1].faults
        told += [event.kind for event in rig.events if event.kind.startswith("sensor.")]
    assert told == kinds


@pytest.mark.parametrize("fault", ENDS)
def test_a_failed_sensor_is_no_better_after_the_monitor_was_inactive(fault: str) -> None:
    failing, kinds = ENDS[fault]
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["scan"]})
        keep_sending(rig, 2.0, working)
        keep_sending(rig, 4.0, failing)
        rig.transition("sensormonitor", Transition.DEACTIVATE)
        keep_sending(rig, 2.0, failing)
        rig.transition("sensormonitor", Transition.ACTIVATE)
        health = rig.collect("sensor_health", SensorHealth)
        keep_sending(rig, 9.0, failing)
        assert {tuple(each.fault for each in report.faults) for report in health} == {(fault,)}
        keep_sending(rig, 2.0, working)
    assert [event.kind for event in rig.events if event.kind.startswith("sensor.")] == kinds


def test_a_jump_is_held_against_a_pose_for_as_long_over_a_restart_of_the_monitor() -> None:
    def stand(rig: Rig, seconds: float, x: float) -> None:
        for _ in range(round(seconds / 0.1)):
            rig.advance(0.1)
            now = rig.clock.now() / 1e9
            rig.publish("localization", Odometry(now, "map", "base_link", Pose.planar(x, 0.0, 0.0), Twist()))

    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": []})
        stand(rig, 1.0, 0.0)
        stand(rig, 1.0, 5.0)
        state = kept(rig)
    with Rig(start=2.0) as rig:
        monitor = rig.add(SensorMonitor, parameters={"expected": []}, state=State.INACTIVE)
        monitor.restore(state)
        rig.transition("sensormonitor", Transition.ACTIVATE)
        health = rig.collect("sensor_health", SensorHealth)
        stand(rig, 4.0, 5.0)
        assert [[each.fault for each in report.faults] for report in health] == [["jumpy"]] * 8
        stand(rig, 2.0, 5.0)
        assert not health[-1].faults


def test_what_was_wrong_at_another_topic_is_over_after_a_restart_of_the_monitor() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["scan"]})
        keep_sending(rig, 2.0, working)
        rig.advance(3.0)
        state = kept(rig)
    with Rig(start=5.0) as rig:
        given = {"expected": ["scan"]}
        monitor = rig.add(SensorMonitor, parameters=given, connections={"scan": "front/scan"}, state=State.INACTIVE)
        monitor.restore(state)
        rig.transition("sensormonitor", Transition.ACTIVATE)
        health = rig.collect("sensor_health", SensorHealth)
        rig.advance(2.0)
        assert not any(report.faults for report in health)
        assert [event.kind for event in rig.events if event.kind.startswith("sensor.")] == ["sensor.ok"]
