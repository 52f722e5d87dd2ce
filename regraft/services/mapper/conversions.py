"""From the messages of the bus to the mapper's own types, and back."""

from __future__ import annotations

import numpy as np

from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.planar import Pose2D
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.maps.scan import Scan

MAP_FRAME = "map"


def planar_pose(pose: geometry.Pose) -> Pose2D:
    """Return a pose seen from above."""
    return Pose2D(pose.x, pose.y, pose.yaw)


def localized(odometry: sensors.Odometry, pose: Pose2D) -> sensors.Odometry:
    """Return an odometry with the robot's pose in the map instead of its own."""
    placed = geometry.Pose.planar(pose.x, pose.y, pose.yaw)
    return sensors.Odometry(odometry.stamp, MAP_FRAME, odometry.child_frame, placed, odometry.twist)


def scan_of(message: sensors.LaserScan) -> Scan:
    """Return a scan with the lidar's place on the robot."""
    return Scan(
        message.stamp,
        message.ranges.astype(np.float64),
        planar_pose(message.pose),
        message.angle_min,
        message.angle_increment,
        message.range_min,
        message.range_max,
    )


def map_of(grid: Grid, stamp: float) -> maps.OccupancyGrid:
    """Return a grid as a message."""
    return maps.OccupancyGrid(
        stamp, MAP_FRAME, grid.resolution, geometry.Pose.planar(grid.x, grid.y, 0.0), grid.per_cent()
    )
