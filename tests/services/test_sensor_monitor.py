"""Promises of the sensor monitor, on the simulated robot whose sensors are made to fail."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.health import Diagnostic, Level, SensorHealth
from regraft.bus_schema.messages.sensors import DepthImage, Image, LaserScan, LightLevel, Odometry
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import describe, parameter_set
from regraft.component.parameters import ParameterError
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.services.sensor_monitor import SensorMonitor
from regraft.sim_service.camera_component import Camera
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD

from .rigs import connect, disconnect, run, set_parameters, why_refused, world_on

NO_NOSE = r"expected.0: there is no sensor 'nose'; there are: depth, image, localization, odometry, scan"
Depths = npt.NDArray[np.float32]


@dataclass
class Watched:
    """FROG's sensors, and what the monitor says of them."""

    rig: Rig
    world: World
    health: list[SensorHealth]
    diagnostics: list[Diagnostic]

    def drive(self, seconds: float, turn: float = 0.4) -> None:
        """Turn on the spot for some time."""
        for _ in range(round(seconds / 0.05)):
            self.rig.publish("velocity", Twist.planar(0.0, turn))
            run(self.rig, self.world, 0.05)

    def faults(self) -> dict[str, str]:
        """Return what is wrong now, by topic."""
        return {fault.topic: fault.fault for fault in self.health[-1].faults}

    def told(self) -> list[tuple[str, Level]]:
        """Return the diagnostics so far, by subject."""
        return [(diagnostic.subject, diagnostic.level) for diagnostic in self.diagnostics]


@pytest.fixture
def watched() -> Iterator[Watched]:
    """Return FROG with a camera and a monitor, two seconds into the run."""
    with Rig(seed=3) as rig:
        world = world_on(rig)
        given = {**FROG_WORLD, "renderer": "ray", "width": 40, "height": 30}
        rig.add(Camera, "camera", given, {"image": "camera/image"})
        diagnostics: list[Diagnostic] = []
        rig.bus.subscribe(rig.keys.diagnostics, lambda s: diagnostics.append(codec.decode(s.payload, Diagnostic)))
        health = rig.collect("sensor_health", SensorHealth)
        rig.add(SensorMonitor, "monitor", connections={"image": "camera/image"})
        run(rig, world, 2.0)
        yield Watched(rig, world, health, diagnostics)


def blank(stamp: float) -> Image:
    """Return a picture of one colour."""
    return Image(stamp, "camera_optical", "base_link", Pose(), 1.0, np.full((60, 80, 3), 255, np.uint8))


FAILURES = [
    ("camera", {"failure": "black"}, "camera/image", "black"),
    ("camera", {"failure": "frozen"}, "camera/image", "frozen"),
    ("camera", {"failure": "silent"}, "camera/image", "silent"),
    ("world", {"scan_failure": "silent"}, "scan", "silent"),
    ("world", {"scan_failure": "frozen"}, "scan", "frozen"),
    ("world", {"scan_failure": "dropout", "scan_dropout": 0.3}, "scan", "dropouts"),
    ("world", {"scan_failure": "dropout", "scan_dropout": 0.9}, "scan", "blind"),
    ("world", {"odometry_failure": "silent"}, "odometry", "silent"),
    ("world", {"odometry_failure": "frozen"}, "odometry", "frozen"),
]


@pytest.mark.parametrize(("component", "failing", "topic", "fault"), FAILURES)
def test_every_failure_is_told_once_by_its_topic_and_so_is_its_end(
    watched: Watched, component: str, failing: dict[str, object], topic: str, fault: str
) -> None:
    watched.drive(1.0)
    assert watched.faults() == {}
    set_parameters(watched.rig, component, **failing)
    watched.drive(4.0)
    assert watched.faults() == {topic: fault}
    watched.drive(2.0)
    set_parameters(watched.rig, component, **dict.fromkeys(list(failing)[:1], "none"))
    watched.drive(1.5)
    # What was frozen comes back somewhere else at once.
    jumped = {"odometry": "jumpy"} if (topic, fault) == ("odometry", "frozen") else {}
    assert watched.faults() == jumped
    watched.drive(5.0)
    assert watched.faults() == {}
    assert watched.told()[0][0] == topic
    assert watched.told()[-1] == (topic, Level.OK)
    kinds = [event.kind for event in watched.rig.events if event.kind.startswith("sensor.")]
    assert kinds == [f"sensor.{fault}", *(["sensor.jumpy"] if jumped else []), "sensor.ok"]


def test_healthy_sensors_raise_no_alarm_standing_or_driving_in_light_or_dark(watched: Watched) -> None:
    for darkness in (0.0, 1.0):
        watched.rig.publish("light", LightLevel(0.0, darkness))
        run(watched.rig, watched.world, 4.0)
        watched.drive(4.0)
    assert not any(health.faults for health in watched.health)
    assert not watched.diagnostics
    assert set(watched.health[-1].watched) == {"camera/image", "scan", "odometry"}


def test_a_depth_camera_is_watched_for_silence_repetition_and_blindness() -> None:
    noise = np.random.default_rng(1)

    def send(rig: Rig, seconds: float, depths: Callable[[], Depths]) -> None:
        for _ in range(round(seconds / 0.5)):
            rig.advance(0.5)
            image = DepthImage(rig.clock.now() / 1e9, "eye", "base_link", Pose(), 1.5, 0.3, 5.0, depths())
            rig.publish("depth", image)

    def working() -> Depths:
        return noise.uniform(0.5, 4.0, (9, 16)).astype(np.float32)

    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["depth"]})
        health = rig.collect("sensor_health", SensorHealth)
        steps: list[tuple[Callable[[], Depths], list[str]]] = [
            (working, []),
            (lambda: np.full((9, 16), np.inf, np.float32), ["blind"]),
            (working, []),
            (lambda: np.ones((9, 16), np.float32), ["frozen"]),
            (lambda: np.where(working() > 1.5, -np.inf, 1.0).astype(np.float32), []),
        ]
        for depths, fault in steps:
            send(rig, 1.5 if fault == ["blind"] else 4.0, depths)
            assert [each.fault for each in health[-1].faults] == fault
        rig.advance(3.0)
        assert [each.fault for each in health[-1].faults] == ["silent"]


@pytest.mark.parametrize("seed", range(6))
def test_a_working_lidar_raises_no_alarm_wherever_the_robot_starts(seed: int) -> None:
    with Rig(seed=seed) as rig:
        world = world_on(rig)
        health = rig.collect("sensor_health", SensorHealth)
        rig.add(SensorMonitor)
        run(rig, world, 3.0)
    assert len(health) == 6
    assert not any(told.faults for told in health)


def test_a_robot_that_stands_has_no_frozen_odometry_but_one_that_is_told_to_drive_has() -> None:
    def stand(rig: Rig, seconds: float, command: Twist | None) -> None:
        for _ in range(round(seconds / 0.1)):
            rig.advance(0.1)
            if command:
                rig.publish("velocity", command)
            now = rig.clock.now() / 1e9
            rig.publish("odometry", Odometry(now, "odom", "base_link", Pose(), Twist()))

    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["odometry"]})
        health = rig.collect("sensor_health", SensorHealth)
        stand(rig, 5.0, None)
        assert not health[-1].faults
        stand(rig, 4.0, Twist.planar(0.2, 0.0))
        assert [fault.fault for fault in health[-1].faults] == ["frozen"]
        stand(rig, 2.0, None)
        assert not health[-1].faults


def test_a_corrected_pose_may_move_a_little_but_not_far() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["localization"]})
        health = rig.collect("sensor_health", SensorHealth)
        nothing: list[str] = []
        for x, faults in ((0.0, nothing), (0.1, nothing), (0.0, nothing), (1.5, ["jumpy"]), (1.5, ["jumpy"])):
            rig.advance(0.5)
            now = rig.clock.now() / 1e9
            rig.publish("localization", Odometry(now, "map", "base_link", Pose.planar(x, 0.0, 0.0), Twist()))
            rig.advance(0.5)
            assert [fault.fault for fault in health[-1].faults] == faults


def test_only_expected_sensors_are_missed_before_their_first_message() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["scan"]})
        health = rig.collect("sensor_health", SensorHealth)
        rig.advance(4.0)
        assert not health[-1].faults
        rig.advance(3.0)
    assert [(fault.topic, fault.fault) for fault in health[-1].faults] == [("scan", "silent")]
    assert health[-1].watched == ("scan",)


def test_a_sensor_whose_port_is_disconnected_is_watched_no_more(watched: Watched) -> None:
    disconnect(watched.rig, "monitor", "image")
    watched.drive(5.0)
    assert watched.faults() == {}
    assert set(watched.health[-1].watched) == {"scan", "odometry"}
    assert not [event for event in watched.rig.events if event.kind.startswith("sensor.")]


def test_what_was_wrong_with_a_sensor_is_over_when_its_port_is_disconnected(watched: Watched) -> None:
    set_parameters(watched.rig, "camera", failure="black")
    watched.drive(1.0)
    assert watched.faults() == {"camera/image": "black"}
    disconnect(watched.rig, "monitor", "image")
    watched.drive(3.0)
    assert watched.faults() == {}
    assert watched.told() == [("camera/image", Level.ERROR), ("camera/image", Level.OK)]


def test_a_sensor_that_is_connected_again_is_watched_from_its_next_message_on(watched: Watched) -> None:
    disconnect(watched.rig, "monitor", "image")
    watched.drive(5.0)
    set_parameters(watched.rig, "camera", failure="silent")
    connect(watched.rig, "monitor", "image", "camera/image")
    watched.drive(3.0)
    assert set(watched.health[-1].watched) == {"scan", "odometry"}
    set_parameters(watched.rig, "camera", failure="black")
    watched.drive(1.0)
    assert watched.faults() == {"camera/image": "black"}


def test_an_expected_sensor_is_missed_without_a_connection_too(watched: Watched) -> None:
    disconnect(watched.rig, "monitor", "scan")
    watched.drive(4.0)
    assert watched.faults() == {}
    watched.drive(3.0)
    assert watched.faults() == {"scan": "silent"}


def test_what_was_wrong_with_a_sensor_is_over_when_its_port_gets_another_topic(watched: Watched) -> None:
    set_parameters(watched.rig, "camera", failure="silent")
    watched.drive(3.0)
    assert watched.faults() == {"camera/image": "silent"}
    connect(watched.rig, "monitor", "image", "other/image")
    watched.drive(3.0)
    assert watched.faults() == {}
    assert set(watched.health[-1].watched) == {"scan", "odometry"}
    assert watched.told() == [("camera/image", Level.ERROR), ("camera/image", Level.OK)]
    for _ in range(2):
        watched.rig.publish("other/image", blank(watched.rig.clock.now() / 1e9))
        watched.drive(0.5)
    assert watched.faults() == {"other/image": "blank"}
    assert watched.told()[2:] == [("other/image", Level.ERROR)]


def test_a_port_that_gets_another_topic_has_its_pose_jump_by_nothing() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": []})
        health = rig.collect("sensor_health", SensorHealth)

        def stand(topic: str, x: float) -> None:
            for _ in range(4):
                now = rig.clock.now() / 1e9
                rig.publish(topic, Odometry(now, "map", "base_link", Pose.planar(x, 0.0, 0.0), Twist()))
                rig.advance(0.5)
            assert health[-1].watched == (topic,)

        stand("localization", 0.0)
        connect(rig, "sensormonitor", "localization", "other/pose")
        stand("other/pose", 5.0)
    assert not any(told.faults for told in health)


def test_an_expected_sensor_is_given_time_for_its_first_message_from_another_topic() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["scan"]}, connections={"scan": None})
        health = rig.collect("sensor_health", SensorHealth)
        rig.advance(6.0)
        assert [(fault.topic, fault.fault) for fault in health[-1].faults] == [("scan", "silent")]
        connect(rig, "sensormonitor", "scan", "front/scan")
        rig.advance(4.0)
        assert not health[-1].faults
        rig.advance(3.0)
        assert [(fault.topic, fault.fault) for fault in health[-1].faults] == [("front/scan", "silent")]
    told = [(event.kind, event.details["topic"]) for event in rig.events if event.kind.startswith("sensor.")]
    assert told == [("sensor.silent", "scan"), ("sensor.ok", "scan"), ("sensor.silent", "front/scan")]


def test_a_picture_of_one_colour_is_blank() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["image"]})
        health = rig.collect("sensor_health", SensorHealth)
        rig.publish("image", blank(0.2))
        rig.advance(0.5)
    assert [fault.fault for fault in health[-1].faults] == ["blank"]


def test_pictures_and_depths_without_pixels_are_of_no_use_and_spoil_no_other_watch() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor)
        health = rig.collect("sensor_health", SensorHealth)
        ranges = (2.0 + 0.01 * np.random.default_rng(1).standard_normal(90)).astype(np.float32)
        for shape in ((0, 0), (0, 8), (8, 0)):
            now = rig.clock.now() / 1e9
            scan = LaserScan(now, "lidar", "base_link", Pose(), 0.0, math.tau / 90, 0.1, 8.0, ranges + now)
            rig.publish("scan", scan)
            rig.publish("image", Image(now, "eye", "base_link", Pose(), 1.0, np.empty((*shape, 3), np.uint8)))
            depths = np.empty(shape, np.float32)
            rig.publish("depth", DepthImage(now, "eye", "base_link", Pose(), 1.5, 0.3, 5.0, depths))
            rig.advance(0.5)
            assert [(each.topic, each.fault) for each in health[-1].faults] == [("image", "blank"), ("depth", "blind")]
            assert "scan" in health[-1].watched


@pytest.mark.parametrize("shape", [(1, 4000), (4000, 1)])
def test_a_picture_of_one_row_or_column_is_of_use(shape: tuple[int, int]) -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["image"]})
        health = rig.collect("sensor_health", SensorHealth)
        pixels = np.random.default_rng(1).integers(0, 255, (*shape, 3), np.uint8)
        rig.publish("image", Image(0.2, "camera_optical", "base_link", Pose(), 1.0, pixels))
        rig.advance(0.5)
    assert not health[-1].faults


def test_an_unknown_sensor_to_expect_is_refused() -> None:
    with Rig() as rig:
        rig.add(SensorMonitor, parameters={"expected": ["nose"]}, state=State.UNCONFIGURED)
        with pytest.raises(TransitionFailed, match=NO_NOSE):
            rig.transition("sensormonitor", Transition.CONFIGURE)
        assert len(rig.take_faults()) == 1


def test_an_unknown_sensor_to_expect_is_found_before_anything_starts() -> None:
    given = parameter_set(SensorMonitor, {"expected": ["scan", "nose"]}).values
    with pytest.raises(ParameterError) as caught:
        SensorMonitor.check_parameters(given, 0)
    assert [place for place, _ in caught.value.parts] == ["expected.1"]


def test_an_unknown_sensor_to_expect_is_not_set() -> None:
    with Rig() as rig:
        monitor = rig.add(SensorMonitor)
        assert re.search(NO_NOSE, why_refused(rig, "sensormonitor", expected=["nose"]))
        assert monitor.expected == ("odometry", "scan")
        set_parameters(rig, "sensormonitor", expected=["image"])


def test_the_monitor_does_not_know_the_truth() -> None:
    inputs = [port for port in describe(SensorMonitor).ports if port.direction == "input"]
    assert all("truth" not in port.topic and port.type != "regraft/GroundTruth" for port in inputs)
    assert not any(port.required for port in inputs)
