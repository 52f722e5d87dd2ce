"""Odometry from wheel encoders."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import mujoco

from regraft.planar import Pose2D, Twist2D
from regraft.sim_service.layout.headings import wrap_heading
from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.robot.drive import DifferentialDrive


@dataclass(frozen=True, slots=True)
class OdometrySettings:
    """How good the encoders are and where the odom frame lies.

    `travel_noise` is the standard deviation (m) of each wheel's travel after 1 m; it grows with the square
    root of the distance. The other errors are systematic, as in J. Borenstein, L. Feng: Measurement and
    correction of systematic odometry errors in mobile robots, IEEE Trans. Robotics and Automation 12(6), 1996,
    each as a share: by how much both wheels are taken for larger than they are (`radius_error`), the right
    wheel for larger than the left one (`radius_difference`), and the wheels for farther apart (`track_error`).
    With `at_start_pose` the odom frame coincides with the map frame; without, it begins at zero.
    """

    travel_noise: float = 0.0
    radius_error: float = 0.0
    radius_difference: float = 0.0
    track_error: float = 0.0
    at_start_pose: bool = True


@dataclass(frozen=True, slots=True)
class Drift:
    """A fault that spoils the odometry while it lasts: extra yaw (rad) for each metre, extra length as a share."""

    yaw_per_metre: float = 0.0
    scale: float = 0.0


NO_DRIFT = Drift()


@dataclass(frozen=True, slots=True)
class OdometryReading:
    """Pose in the odom frame and twist in the base frame at a time (s)."""

    time: float
    pose: Pose2D
    twist: Twist2D

    def to_plain(self) -> dict[str, Any]:
        """Return the reading as plain data."""
        pose, twist = self.pose, self.twist
        return {"time": self.time, "pose": [pose.x, pose.y, pose.yaw], "twist": [twist.v, twist.w]}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> Self:
        """Return the reading that `to_plain` described."""
        pose, twist = Pose2D(*map(float, plain["pose"])), Twist2D(*map(float, plain["twist"]))
        return cls(float(plain["time"]), pose, twist)


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
        self._left_radius = drive.wheel_radius * (1.0 + settings.radius_error - settings.radius_difference / 2.0)
        self._right_radius = drive.wheel_radius * (1.0 + settings.radius_error + settings.radius_difference / 2.0)
        self._track = drive.track * (1.0 + settings.track_error)
        pose = start if settings.at_start_pose else Pose2D(0.0, 0.0, 0.0)
        self._reading = OdometryReading(0.0, pose, Twist2D(0.0, 0.0))
        self._left_angle, self._right_angle = self._angles(data)

    def reading(self) -> OdometryReading:
        """Return the result of the last update."""
        return self._reading

    def update(self, data: mujoco.MjData, step: int, time: float, drift: Drift = NO_DRIFT) -> None:
        """Read the encoders at a physics step and a time (s) later than the last update, spoiled by a drift."""
        left_angle, right_angle = self._angles(data)
        left = (left_angle - self._left_angle) * self._left_radius
        right = (right_angle - self._right_angle) * self._right_radius
        self._left_angle, self._right_angle = left_angle, right_angle
        if self._settings.travel_noise > 0.0:
            errors = generator(self._seed, "odometry", step).standard_normal(2)
            left += float(errors[0]) * self._settings.travel_noise * math.sqrt(abs(left))
            right += float(errors[1]) * self._settings.travel_noise * math.sqrt(abs(right))
        self._reading = self._moved(left, right, time, drift)

    def snapshot(self) -> dict[str, Any]:
        """Return pose, twist and wheel angles as plain data."""
        return {**self._reading.to_plain(), "angles": [self._left_angle, self._right_angle]}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over pose, twist and wheel angles of a snapshot."""
        self._reading = OdometryReading.from_plain(snapshot)
        self._left_angle, self._right_angle = map(float, snapshot["angles"])

    def _angles(self, data: mujoco.MjData) -> tuple[float, float]:
        left, right = self._drive.angle_addresses
        return float(data.qpos[left]), float(data.qpos[right])

    def _moved(self, left: float, right: float, time: float, drift: Drift) -> OdometryReading:
        """Return the reading after the wheels' travels (m), taken as an arc."""
        last = self._reading
        forward, turn = (left + right) / 2.0, (right - left) / self._track
        if drift != NO_DRIFT:
            turn += drift.yaw_per_metre * abs(forward)
            forward *= 1.0 + drift.scale
        # The chord of the arc points along the mean heading.
        heading = last.pose.yaw + turn / 2.0
        pose = Pose2D(
            last.pose.x + forward * math.cos(heading),
            last.pose.y + forward * math.sin(heading),
            wrap_heading(last.pose.yaw + turn),
        )
        period = time - last.time
        return OdometryReading(time, pose, Twist2D(forward / period, turn / period))
