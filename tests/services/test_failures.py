"""Promises of the sensors that can be made to fail, and of the charger."""

import math

import numpy as np
import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.power import BatteryState, ChargerState
from regraft.bus_schema.messages.sensors import Image, LaserScan, Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.lifecycle import State
from regraft.component.parameters import ParameterError
from regraft.sim_service.camera_component import Camera
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD, frog_scene

from .rigs import FROG, run, set_parameters, world_on


def entries(schedule: str) -> list[dict[str, object]]:
    """Return a schedule such as ``30 silent, 60 none`` as the parameters of failures take it."""
    return [{"at": float(at), "failure": failure} for at, failure in (entry.split() for entry in schedule.split(","))]


def of_device(device: str, schedule: str) -> list[dict[str, object]]:
    """Return a schedule of one device as the world's parameter ``failures`` takes it."""
    return [{"device": device, **entry} for entry in entries(schedule)]


def camera_on(rig: Rig, **parameters: object) -> Camera:
    given = {**FROG_WORLD, "renderer": "ray", "width": 40, "height": 30, "rate": 2.0, **parameters}
    return rig.add(Camera, "camera", given, {"image": "camera/image"})


def test_a_camera_fails_by_its_schedule_and_comes_back() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig, failures=entries("1.5 black, 3 frozen, 4.5 silent, 6 none"))
        images = rig.collect("camera/image", Image)
        run(rig, world, 7.0)
        told = [event.text for event in rig.events if event.kind == "camera.failure"]
    by_time = {round(image.stamp, 2): image.pixels for image in images}
    assert list(by_time) == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 6.0, 6.5, 7.0]
    assert by_time[1.0].max() > 50
    assert max(by_time[time].max() for time in (1.5, 2.0, 2.5)) == 0
    for time in (3.0, 3.5, 4.0):
        np.testing.assert_array_equal(by_time[time], by_time[1.0])
    assert (by_time[6.0] != by_time[6.5]).any()
    assert told == ["image: black", "image: frozen", "image: silent", "image: none"]


def test_a_camera_is_made_to_fail_over_the_bus() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        camera_on(rig)
        images = rig.collect("camera/image", Image)
        run(rig, world, 1.0)
        set_parameters(rig, "camera", failure="black")
        run(rig, world, 1.0)
        set_parameters(rig, "camera", failure="none")
        run(rig, world, 1.0)
    assert [bool(image.pixels.any()) for image in images] == [True, True, False, False, True, True]


def test_the_lidar_fails_as_it_is_told_and_comes_back() -> None:
    with Rig(seed=3) as rig:
        schedule = of_device("scan", "1 frozen, 2 dropout, 3 silent, 4 none, 4.6 zeros")
        world = world_on(rig, failures=schedule, scan_dropout=0.4)
        scans = rig.collect("scan", LaserScan)
        run(rig, world, 5.0)
    at = {round(scan.stamp, 2): scan.ranges for scan in scans}
    assert len(at) == 20
    assert not any(3.0 <= time < 4.0 for time in at)
    for time in (1.0, 1.2, 1.8):
        np.testing.assert_array_equal(at[time], at[0.8])
    assert (at[4.0] != at[4.2]).any()
    assert (at[4.4] > 0.0).all()
    assert (at[4.6] == 0.0).all()
    lost = np.isinf(at[2.4]) & np.isfinite(at[0.8])
    assert lost.mean() == pytest.approx(0.4 * np.isfinite(at[0.8]).mean(), abs=0.08)


def test_the_odometry_fails_as_it_is_told_and_comes_back() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig, failures=of_device("odometry", "2 frozen, 4 silent, 5 none"))
        odometry, truth = rig.collect("odometry", Odometry), rig.collect("ground_truth", GroundTruth)
        for _ in range(140):
            rig.publish("velocity", Twist.planar(0.0, 0.5))
            run(rig, world, 0.05)
    at = {round(message.stamp, 2): message.pose for message in odometry}
    really = {round(message.stamp, 2): message.pose for message in truth}
    assert not any(4.0 <= time < 4.99 for time in at)
    assert {at[time].yaw for time in (2.0, 2.5, 3.95)} == {at[1.95].yaw}
    for time in (1.5, 5.5):
        assert math.remainder(at[time].yaw - really[time].yaw, math.tau) == pytest.approx(0.0, abs=0.05)


def test_a_drift_is_set_over_the_bus_and_its_error_stays() -> None:
    def drive(seconds: float) -> float:
        for _ in range(round(seconds / 0.05)):
            rig.publish("velocity", Twist.planar(0.1, 0.0))
            run(rig, world, 0.05)
        return math.remainder(odometry[-1].pose.yaw - truth[-1].pose.yaw, math.tau)

    with Rig(seed=3) as rig:
        world = world_on(rig)
        odometry, truth = rig.collect("odometry", Odometry), rig.collect("ground_truth", GroundTruth)
        assert drive(1.0) == pytest.approx(0.0, abs=0.01)
        set_parameters(rig, "world", odometry_failure="drift", odometry_drift_yaw=1.0)
        assert drive(2.0) == pytest.approx(0.2, abs=0.02)
        set_parameters(rig, "world", odometry_failure="none")
        assert drive(1.0) == pytest.approx(0.2, abs=0.02)


def test_failures_survive_a_restart_from_a_checkpoint() -> None:
    scan, odometry = of_device("scan", "0.5 frozen, 3 dropout"), of_device("odometry", "1 frozen, 2.5 drift")
    failures = [scan[0], *odometry, scan[1]]

    def go_on(rig: Rig, world: World) -> list[bytes]:
        scans, odometry = rig.collect("scan", LaserScan), rig.collect("odometry", Odometry)
        for _ in range(50):
            rig.publish("velocity", Twist.planar(0.1, 0.5))
            run(rig, world, 0.05)
        return [codec.encode(message) for message in (*scans, *odometry)]

    with Rig(seed=3) as rig:
        world = world_on(rig, failures=failures)
        run(rig, world, 1.5)
        checkpoint = codec.encode(rig.runtimes["world"].checkpoints.snapshot())
        expected = go_on(rig, world)
    with Rig(seed=3, start=1.5) as rig:
        successor = world_on(rig, failures=failures)
        successor.restore(codec.unpack_plain(checkpoint)["state"])
        assert go_on(rig, successor) == expected


@pytest.mark.parametrize(
    ("cls", "parameters", "complaint"),
    [
        (
            World,
            {"failures": of_device("scan", "30 black")},
            "failures.0.failure: 'black': scan can fail as one of: none, silent",
        ),
        (
            Camera,
            {"failures": entries("30 blind")},
            "failures.0.failure: is 'blind', must be one of: none, black, froz",
        ),
        (Camera, {"failures": entries("-1 black")}, "failures.0.at: is -1.0, must be at least 0.0"),
        (Camera, {"failures": [{"failure": "black"}]}, "failures.0.at: is missing"),
        (Camera, {"failures": "30 black"}, "failures: must be a list of records, is str"),
        (World, {"failures": of_device("scann", "30 frozen")}, "failures.0.device: there is no device 'scann'.*'scan'"),
        (World, {"failures": of_device("scan", "30 silent, 20 none")}, "failures.1.at: 20 comes after 30: put the"),
        (World, {"people": [{"name": "visitor", "waypoints": [{"x": 1.0}]}]}, "people.0.waypoints.0.y: is missing"),
        (World, {"people": [{"name": "visitor", "waypoints": [{"x": 1.0, "y": 0.0}]}]}, "two or more waypoints"),
    ],
)
def test_a_component_does_not_start_with_failures_or_walks_that_cannot_be(
    cls: type[World | Camera], parameters: dict[str, object], complaint: str
) -> None:
    with Rig() as rig, pytest.raises(ParameterError, match=complaint):
        rig.add(cls, "it", {**FROG_WORLD, **parameters}, state=State.UNCONFIGURED)


def put_robot(world: World, x: float, y: float) -> None:
    """Take the robot up and set it down somewhere, through the world's own snapshot."""
    scene = frog_scene()
    state = world.snapshot()
    physics = np.frombuffer(state["simulation"]["physics"], "<f8").copy()
    first = 1 + scene.free_joint_position("base")
    physics[first : first + 2] = (x, y)
    state["simulation"]["physics"] = physics.tobytes()
    world.restore(state)


def test_the_charger_is_felt_on_the_dock_and_nowhere_else() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig, charger_power=15.0)
        chargers = rig.collect("charger", ChargerState)
        for x, y in ((0.14, 0.0), (0.0, -0.16), (-0.1, 0.1), (1.0, -1.0)):
            put_robot(world, x, y)
            run(rig, world, 1.0)
    assert len(chargers) == 8
    assert [state.connected for state in chargers[1::2]] == [True, False, True, False]
    assert [state.power for state in chargers[1::2]] == [15.0, 0.0, 15.0, 0.0]


def test_a_robot_with_an_empty_battery_does_not_drive_until_it_has_power_again() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        truth = rig.collect("ground_truth", GroundTruth)

        def turn(energy: float) -> float:
            rig.publish("battery", BatteryState(0.0, energy, 2000.0, energy / 2000.0, 7.0))
            run(rig, world, 1.0)
            for _ in range(10):
                rig.publish("velocity", Twist.planar(0.0, 0.5))
                run(rig, world, 0.05)
            return truth[-1].twist.turn

        assert abs(turn(0.0)) < 0.01
        assert turn(10.0) == pytest.approx(0.5, abs=0.05)
        told = [event.text for event in rig.events if event.kind == "world.power"]
    assert told == ["the battery is empty: the robot stands still", "there is power to drive again"]


@pytest.mark.parametrize("commanded", [True, False], ids=["at each tick", "once"])
def test_a_robot_that_is_driving_stands_as_soon_as_its_battery_is_empty(*, commanded: bool) -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig, drive_timeout=10.0)
        truth = rig.collect("ground_truth", GroundTruth)
        rig.publish("velocity", Twist.planar(0.0, 0.5))
        run(rig, world, 0.5)
        assert truth[-1].twist.turn == pytest.approx(0.5, abs=0.05)
        for _ in range(2):
            rig.publish("battery", BatteryState(0.0, 0.0, 2000.0, 0.0, 7.0))
            for _ in range(3):
                if commanded:
                    rig.publish("velocity", Twist.planar(0.0, 0.5))
                run(rig, world, 0.05)
            assert abs(truth[-1].twist.turn) < 0.02
        told = [event.text for event in rig.events if event.kind == "world.power"]
        rig.publish("battery", BatteryState(0.0, 10.0, 2000.0, 0.005, 7.0))
        run(rig, world, 0.5)
        assert abs(truth[-1].twist.turn) < 0.02  # the old command is forgotten
    assert told == ["the battery is empty: the robot stands still"]


def test_a_restarted_world_stands_while_the_battery_is_empty_and_reports_nothing_again() -> None:
    failures = of_device("scan", "0.2 frozen")
    with Rig(seed=3) as rig:
        world = world_on(rig, failures=failures)
        rig.publish("battery", BatteryState(0.0, 0.0, 2000.0, 0.0, 7.0))
        rig.publish("velocity", Twist.planar(0.0, 0.5))
        run(rig, world, 0.5)
        checkpoint = codec.encode(rig.runtimes["world"].checkpoints.snapshot())
        assert {"world.power", "world.failure"} <= {event.kind for event in rig.events}
    with Rig(seed=3, start=0.5) as rig:
        successor = world_on(rig, failures=failures)
        successor.restore(codec.unpack_plain(checkpoint)["state"])
        truth = rig.collect("ground_truth", GroundTruth)
        for _ in range(8):
            rig.publish("velocity", Twist.planar(0.0, 0.5))
            run(rig, successor, 0.05)
        assert abs(truth[-1].twist.turn) < 0.01
        rig.publish("battery", BatteryState(0.0, 0.0, 2000.0, 0.0, 7.0))
        rig.publish("velocity", Twist.planar(0.0, 0.5))
        run(rig, successor, 0.1)
        assert [event.text for event in rig.events if event.kind in ("world.power", "world.failure")] == []


def test_a_visitor_is_sent_on_a_walk_by_a_parameter() -> None:
    with Rig(seed=3) as rig:
        file = FROG.replace("world.xml", "world_with_visitor.xml")
        waypoints = [{"x": 2.0, "y": -2.0}, {"x": -2.0, "y": -2.0}]
        people = [{"name": "visitor", "waypoints": waypoints, "speed": 0.8}]
        world = rig.add(World, parameters={**FROG_WORLD, "file": file, "people": people})
        scans = rig.collect("scan", LaserScan)
        run(rig, world, 3.0)
    seen = np.isfinite(scans[0].ranges) & np.isfinite(scans[-1].ranges)
    assert (np.abs(scans[0].ranges[seen] - scans[-1].ranges[seen]) > 0.3).any()
