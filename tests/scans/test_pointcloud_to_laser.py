"""The component makes scans of the images of a depth camera on a simulated robot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regraft import ParameterError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Pose, Quaternion, Vector3
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.power import EnergyUse
from regraft.bus_schema.messages.sensors import DepthImage, LaserScan
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import describe
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.services.scans.pointcloud_to_laser import PointcloudToLaser
from regraft.sim_service.depth_camera import DepthCamera
from regraft.testing import Rig
from tests.devices.worlds import FLOOR, PUCK, on_bus, robot, tick, world_on
from tests.services.rigs import set_parameters, why_refused

EYE = '<camera name="eye" pos="0.03 0 0.2" xyaxes="0 -1 0 0 0 1" fovy="60" resolution="40 30"/>'
LOW = '<body name="low" pos=".7 -.4 .01"><geom type="box" size=".02 .1 .01"/></body>'
HANGING = '<body name="hanging" pos=".7 .4 1.5"><geom type="box" size=".02 .1 .1"/></body>'
ROOM = f'{FLOOR}<body name="wall" pos="2.05 0 1"><geom type="box" size=".05 4 1"/></body>{LOW}{HANGING}'


def seen(folder: Path, **parameters: Any) -> list[LaserScan]:
    """Return the scans of a robot's camera in the room."""
    with Rig(seed=3) as rig:
        body = robot(folder, "", body=PUCK + EYE, moves=True)
        world = world_on(rig, folder, body, body=ROOM)
        how = {"camera": "eye", "width": 40, "height": 30, "rate": 5.0, "renderer": "ray", "noise": 0.0}
        rig.add(DepthCamera, parameters={**on_bus(folder, body, body=ROOM), **how, "range_min": 0.1})
        scans = rig.collect("scan", LaserScan)
        rig.add(PointcloudToLaser, "cloud", {"base_height": 0.0, **parameters})
        tick(rig, world, 12)
    return scans


def test_a_wall_is_where_it_is_and_neither_floor_nor_low_nor_high_things_are_obstacles(tmp_path: Path) -> None:
    scan = seen(tmp_path)[-1]
    bearings = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    np.testing.assert_allclose(scan.ranges * np.cos(bearings), 1.97, rtol=0.03)
    assert bearings[-1] - bearings[0] < scan.angle_increment * len(bearings) < 1.4
    assert scan.base_frame == "base_link"
    assert (scan.pose.x, scan.pose.yaw) == pytest.approx((0.03, 0.0), abs=1e-3)


def test_what_counts_is_a_matter_of_the_heights(tmp_path: Path) -> None:
    with_floor = seen(tmp_path, min_height=0.0, beams=20)[-1]
    assert len(with_floor.ranges) == 20
    assert with_floor.ranges.min() < 0.8
    assert seen(tmp_path, min_height=2.5, max_height=3.0)[-1].ranges.min() == np.inf


@dataclass
class Eye:
    """A camera whose images are made up, and what the component publishes."""

    rig: Rig
    scans: list[LaserScan]
    told: list[Diagnostic]
    energy: list[EnergyUse]

    def show(self, **other: Any) -> None:
        """Publish an image of a wall 2 m away, with ``other`` fields."""
        pose = Pose(Vector3(0.2, 0.0, 0.3), Quaternion())
        depths = np.full((6, 8), 2.0, np.float32)
        image = DepthImage(self.rig.clock.now() / 1e9, "eye_optical", "base_link", pose, 1.5, 0.3, 5.0, depths)
        self.rig.publish("depth", replace(image, **other))


@pytest.fixture
def eye() -> Iterator[Eye]:
    with Rig(start=1.0) as rig:
        told: list[Diagnostic] = []
        rig.bus.subscribe(rig.keys.diagnostics, lambda sample: told.append(codec.decode(sample.payload, Diagnostic)))
        found = Eye(rig, rig.collect("scan", LaserScan), told, rig.collect("energy", EnergyUse))
        rig.add(PointcloudToLaser, "cloud", {"power": 2.5})
        yield found


def test_a_scan_has_the_moment_of_its_image_and_the_level_place_of_the_camera(eye: Eye) -> None:
    down = Quaternion(0.0, math.sin(0.1), 0.0, math.cos(0.1))
    eye.show(stamp=0.75, pose=Pose(Vector3(0.2, 0.1, 0.3), down))
    (scan,) = eye.scans
    assert (scan.stamp, scan.frame, scan.base_frame) == (0.75, "eye_scan", "base_link")
    assert scan.pose == Pose(Vector3(0.2, 0.1, 0.3), Quaternion())
    assert (scan.range_min, scan.range_max) == (0.3, 5.0)


def test_a_camera_that_moves_on_its_robot_is_followed(eye: Eye) -> None:
    eye.show()
    eye.show(stamp=2.0, pose=Pose(Vector3(0.2, 0.0, 0.3), Quaternion.from_yaw(1.0)))
    assert [scan.pose.yaw for scan in eye.scans] == pytest.approx([0.0, 1.0])
    np.testing.assert_allclose(eye.scans[0].ranges, eye.scans[1].ranges, rtol=1e-5)


@pytest.mark.parametrize(
    ("other", "why"),
    [
        ({"pose_frame": "map"}, "the camera must be on the robot, at 'base_link', but it is at 'map'"),
        ({"pose": Pose(orientation=Quaternion(0.0, 0.7, 0.0, 0.714))}, "the camera must look ahead"),
        ({"depths": np.empty((0, 4), np.float32)}, "the images must have pixels"),
    ],
)
def test_images_that_make_no_scan_are_reported_once(eye: Eye, other: dict[str, Any], why: str) -> None:
    for _ in range(3):
        eye.show(**other)
    assert eye.scans == []
    assert [each.level.value for each in eye.told if why in each.text] == ["error"]
    eye.show()
    assert len(eye.scans) == 1
    assert eye.told[-1].level.value == "ok"


def test_an_empty_band_of_heights_is_refused() -> None:
    with pytest.raises(ParameterError, match="must be above min_height"):
        PointcloudToLaser.check_parameters({"min_height": 0.5, "max_height": 0.5}, 0)


def test_a_band_of_heights_that_becomes_empty_while_it_works_is_refused_and_the_scans_continue(eye: Eye) -> None:
    assert "must be above min_height" in why_refused(eye.rig, "cloud", min_height=1.5)
    eye.show()
    (scan,) = eye.scans
    assert np.isfinite(scan.ranges).all()
    assert not why_refused(eye.rig, "cloud", min_height=1.5, max_height=2.0)


def test_another_height_of_the_base_counts_from_the_next_image_on(eye: Eye) -> None:
    eye.show()
    set_parameters(eye.rig, "cloud", base_height=2.0)
    eye.show()
    low, above_the_band = eye.scans
    assert np.isfinite(low.ranges).all()
    assert (above_the_band.ranges == np.inf).all()


def test_a_component_with_an_empty_band_of_heights_is_not_configured() -> None:
    with Rig() as rig:
        rig.add(PointcloudToLaser, "cloud", {"min_height": 1.5}, state=State.UNCONFIGURED)
        with pytest.raises(TransitionFailed, match="must be above min_height"):
            rig.transition("cloud", Transition.CONFIGURE)
        assert len(rig.take_faults()) == 1


def test_the_camera_s_energy_is_booked(eye: Eye) -> None:
    eye.rig.advance(2.0)
    assert sum(use.energy for use in eye.energy) == pytest.approx(5.0)


def test_a_robot_gives_height_and_power() -> None:
    taken = {each.name for each in describe(PointcloudToLaser).parameters}
    assert {"base_height", "power", "min_height", "max_height", "beams"} == taken
