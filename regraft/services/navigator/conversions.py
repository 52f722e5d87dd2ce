"""From the messages of the bus to the navigator's own types."""

from __future__ import annotations

import math

import numpy as np

from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.planar import Pose2D, Twist2D
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.sensing.scan import Scan


def planar_pose(pose: geometry.Pose) -> Pose2D:
    """Return a pose seen from above."""
    return Pose2D(pose.x, pose.y, pose.yaw)


def planar_twist(twist: geometry.Twist) -> Twist2D:
    """Return a twist in the plane."""
    return Twist2D(twist.forward, twist.turn)


def grid_of(message: maps.OccupancyGrid) -> OccupancyGrid:
    """Return the grid of a map; raises ValueError if its rows do not run along its frame's axes."""
    if abs(message.origin.yaw) > 1e-6:
        raise ValueError(f"the map's origin is turned by {message.origin.yaw:.3f} rad, must not be turned")
    return OccupancyGrid(message.cells, message.resolution, message.origin.x, message.origin.y)


def same_map(one: maps.OccupancyGrid, other: maps.OccupancyGrid) -> bool:
    """Return whether two maps differ at most in their stamps."""
    layout = (one.frame, one.resolution, one.origin) == (other.frame, other.resolution, other.origin)
    return layout and np.array_equal(one.cells, other.cells)


def scan_of(message: sensors.LaserScan) -> Scan:
    """Return a scan with the sensor's place on the robot; its beams are in counter-clockwise order.

    Beams that all look the same way show no surroundings. Such a scan has none.
    """
    ranges, first, increment = message.ranges.astype(np.float64), message.angle_min, message.angle_increment
    if increment < 0.0:
        first += increment * (len(ranges) - 1)
        ranges, increment = ranges[::-1], -increment
    elif increment == 0.0:
        ranges, increment = ranges[:0], math.tau
    return Scan(
        message.stamp, ranges, first, increment, planar_pose(message.pose), message.range_min, message.range_max
    )
