"""Promises where scans say little: in a bare corridor the odometry decides how far the robot has come."""

from __future__ import annotations

import math

import pytest

from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.services.mapper.map_localizer import MapLocalizer
from regraft.services.mapper.mapper import Mapper
from regraft.testing import Rig

from .drives import IN_SIGHT, OUT_OF_SIGHT, Drive, Moment, down_corridor
from .room import MOUNT, RANGE, TICK

pytestmark = pytest.mark.slow

ACROSS = 2.8
"""rad: the heading of a corridor that leads across the rows of a map's cells."""
KNOWN = 0.15
"""m: the noise of the wheels is 0.04 m of 32 m, as a standard deviation."""


def publish(rig: Rig, moment: Moment) -> None:
    rig.advance(TICK)
    read = geometry.Pose.planar(moment.odometry.x, moment.odometry.y, moment.odometry.yaw)
    rig.publish("odometry", sensors.Odometry(moment.time, "odom", "base_link", read, geometry.Twist.planar(0.2, 0.0)))
    if moment.ranges is not None:
        mount = geometry.Pose(geometry.Vector3(MOUNT.x, 0.0, 0.1))
        step = math.tau / 360
        scan = sensors.LaserScan(moment.time, "lidar", "base_link", mount, 0.0, step, 0.12, RANGE, moment.ranges)
        rig.publish("scan", scan)


def map_of(drive: Drive) -> maps.OccupancyGrid:
    ground = drive.ground
    return maps.OccupancyGrid(
        0.0, "map", ground.resolution, geometry.Pose.planar(ground.x, ground.y, 0.0), ground.cells
    )


@pytest.mark.parametrize(
    ("length", "heading"),
    [(OUT_OF_SIGHT, 0.0), (IN_SIGHT, ACROSS)],
    ids=["along the rows", "across"],
)
def test_on_a_given_map_the_place_is_known_all_the_way_down(length: float, heading: float) -> None:
    drive = down_corridor(1, length, heading)
    with Rig() as rig:
        rig.add(MapLocalizer, "localizer")
        places = rig.collect("localization", sensors.Odometry)
        rig.publish("map", map_of(drive))
        for moment in drive.moments:
            publish(rig, moment)
    errors = [
        math.hypot(m.truth.x - p.pose.x, m.truth.y - p.pose.y) for m, p in zip(drive.moments, places, strict=True)
    ]
    assert max(errors) <= KNOWN


def test_who_maps_a_corridor_knows_how_far_it_has_come() -> None:
    drive = down_corridor(1, OUT_OF_SIGHT, ACROSS)
    with Rig() as rig:
        rig.add(Mapper, "mapper")
        places = rig.collect("localization", sensors.Odometry)
        for moment in drive.moments:
            publish(rig, moment)
    (first, *_, last), pose = drive.moments, places[-1].pose
    come = math.hypot(pose.x - first.truth.x, pose.y - first.truth.y)
    assert come == pytest.approx(first.truth.distance(last.truth), abs=KNOWN)
