"""Odometry from wheel encoders."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco

from sim_service.drive import DifferentialDrive
from sim_service.poses import Pose2D, Twist2D, wrap_angle
from sim_service.random_streams import generator


@dataclass(frozen=True, slots=True)
class OdometrySettings:
    """How good the encoders are and where the odom frame lies.

    `travel_noise` is the standard deviation (m) of each wheel's travel after 1 m; it grows with the square
    root of the distance. With `at_start_pose` the odom frame coincides with the map frame; without, it begins
    at zero.
    """

    travel_noise: float = 0.0
    at_start_pose: bool = True


@dataclass(frozen=True, slots=True)
class OdometryReading:
    """Pose in the odom frame and twist in the base frame at a time (s)."""

    time: float
    pose: Pose2D
    twist: Twist2D


class Odometry:
    """Adds up what the wheels turn."""

    def __init__(
        self,
        drive: DifferentialDrive,
        settings: OdometrySettings,
        seed: int,
        start: Pose2D,
        data: mujoco.MjData,
    ) -> None:
        """Begin at the start pose (map frame) or at zero, with the wheels as they stand in `data`."""
        self._drive = drive
        self._settings = settings
        self._seed = seed
        pose = start if settings.at_start_pose else Pose2D(0.0, 0.0, 0.0)
        self._reading = OdometryReading(0.0, pose, Twist2D(0.0, 0.0))
        self._left_angle, self._right_angle = self._angles(data)

    def reading(self) -> OdometryReading:
        """Return the result of the last update."""
        return self._reading

    def update(self, data: mujoco.MjData, step: int, time: float) -> None:
        """Read the encoders at a physics step and a time (s) later than the last update."""
        left_angle, right_angle = self._angles(data)
        left = (left_angle - self._left_angle) * self._drive.wheel_radius
        right = (right_angle - self._right_angle) * self._drive.wheel_radius
        self._left_angle, self._right_angle = left_angle, right_angle
        if self._settings.travel_noise > 0.0:
            errors = generator(self._seed, "odometry", step).standard_normal(2)
            left += float(errors[0]) * self._settings.travel_noise * math.sqrt(abs(left))
            right += float(errors[1]) * self._settings.travel_noise * math.sqrt(abs(right))
        self._reading = self._moved(left, right, time)

    def snapshot(self) -> dict[str, Any]:
        """Return pose, twist and wheel angles as plain data."""
        reading = self._reading
        return {
            "time": reading.time,
            "pose": [reading.pose.x, reading.pose.y, reading.pose.yaw],
            "twist": [reading.twist.v, reading.twist.w],
            "angles": [self._left_angle, self._right_angle],
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over pose, twist and wheel angles of a snapshot."""
        self._reading = OdometryReading(
            float(snapshot["time"]),
            Pose2D(*map(float, snapshot["pose"])),
            Twist2D(*map(float, snapshot["twist"])),
        )
        self._left_angle, self._right_angle = map(float, snapshot["angles"])

    def _angles(self, data: mujoco.MjData) -> tuple[float, float]:
        left, right = self._drive.angle_addresses
        return float(data.qpos[left]), float(data.qpos[right])

    def _moved(self, left: float, right: float, time: float) -> OdometryReading:
        """Return the reading after the wheels' travels (m), taken as an arc."""
        last = self._reading
        forward, turn = (left + right) / 2.0, (right - left) / self._drive.track
        # The chord of the arc points along the mean heading.
        heading = last.pose.yaw + turn / 2.0
        pose = Pose2D(
            last.pose.x + forward * math.cos(heading),
            last.pose.y + forward * math.sin(heading),
            wrap_angle(last.pose.yaw + turn),
        )
        period = time - last.time
        return OdometryReading(time, pose, Twist2D(forward / period, turn / period))
