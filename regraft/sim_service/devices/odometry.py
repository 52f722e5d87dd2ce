"""Odometry from wheel encoders."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from regraft import Output, Parameter
from regraft.bus_schema.messages.geometry import Pose, Twist
from regraft.bus_schema.messages.sensors import Odometry
from regraft.planar import Pose2D, Twist2D
from regraft.sim_service.devices.core.failure_schedule import DRIFT
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.devices.drive import DifferentialDrive
from regraft.sim_service.layout.headings import wrap_heading, yaw_of_matrix
from regraft.sim_service.layout.scene import SceneError


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


class WheelOdometry(Sensor):
    """Adds up what the wheels turn.

    ``travel_noise`` grows with the square root of the distance. The other errors are systematic, as in J. Borenstein,
    L. Feng: Measurement and correction of systematic odometry errors in mobile robots, IEEE Trans. Robotics and
    Automation 12(6), 1996. A drift spoils the odometry while it lasts; the error that it made stays.
    """

    measures = "odometry"

    odometry = Output(Odometry, description="pose and twist by the wheels, every tick")

    drive = Parameter("drive", "the device whose wheels are read", read_only=True)
    travel_noise = Parameter(
        0.0, "standard deviation of a wheel's measured travel after 1 m", minimum=0.0, unit="m", read_only=True
    )
    radius_error = Parameter(
        0.0, "share by which both wheels are taken for too large", minimum=-0.5, maximum=0.5, read_only=True
    )
    radius_difference = Parameter(
        0.0,
        "share by which the right wheel is taken for larger than the left",
        minimum=-0.5,
        maximum=0.5,
        read_only=True,
    )
    track_error = Parameter(
        0.0, "share by which the wheels are taken for too far apart", minimum=-0.5, maximum=0.5, read_only=True
    )
    at_start_pose = Parameter(
        True, "whether the odom frame coincides with the map frame; else it begins at zero", read_only=True
    )
    failure = failure_parameter(DRIFT)
    drift_yaw = Parameter(
        0.2, "what a drift adds to the yaw with each metre", minimum=-10.0, maximum=10.0, unit="rad/m"
    )
    drift_scale = Parameter(0.1, "share that a drift adds to the way", minimum=-1.0, maximum=1.0)

    def build(self) -> None:
        """Begin at the start pose (map frame) or at zero, with the wheels' present angles; raises SceneError."""
        drive = self.kit.siblings.get(self.drive)
        if not isinstance(drive, DifferentialDrive):
            raise SceneError(f"{self.kit.name}: there is no differential drive {self.drive!r} before it in its robot")
        self._drive = drive
        self._left_radius = drive.wheel_radius * (1.0 + self.radius_error - self.radius_difference / 2.0)
        self._right_radius = drive.wheel_radius * (1.0 + self.radius_error + self.radius_difference / 2.0)
        self._track = drive.track * (1.0 + self.track_error)
        pose = self._start() if self.at_start_pose else Pose2D(0.0, 0.0, 0.0)
        self._reading = OdometryReading(0.0, pose, Twist2D(0.0, 0.0))
        self._left_angle, self._right_angle = self._angles()

    def _start(self) -> Pose2D:
        data, base = self.kit.data, self.kit.base
        return Pose2D(float(data.xpos[base][0]), float(data.xpos[base][1]), yaw_of_matrix(data.xmat[base]))

    def reading(self) -> OdometryReading:
        """Return pose and twist by the wheels at the last tick."""
        return self._reading

    def tick(self) -> None:
        """Read the encoders."""
        left_angle, right_angle = self._angles()
        left = (left_angle - self._left_angle) * self._left_radius
        right = (right_angle - self._right_angle) * self._right_radius
        self._left_angle, self._right_angle = left_angle, right_angle
        if self.travel_noise > 0.0:
            errors = self.kit.random(self.kit.name, self.kit.progress.steps).standard_normal(2)
            left += float(errors[0]) * self.travel_noise * math.sqrt(abs(left))
            right += float(errors[1]) * self.travel_noise * math.sqrt(abs(right))
        self._reading = self._moved(left, right)

    def measure(self) -> Odometry:
        """Return the reading as a message."""
        pose, twist = self._reading.pose, self._reading.twist
        return Odometry(
            self.kit.stamp,
            self.kit.frame("odom"),
            self.kit.frame("base_link"),
            Pose.planar(pose.x, pose.y, pose.yaw),
            Twist.planar(twist.v, twist.w),
        )

    def snapshot(self) -> dict[str, Any]:
        """Return pose, twist, wheel angles and the last message as plain data."""
        angles = [self._left_angle, self._right_angle]
        return {**super().snapshot(), **self._reading.to_plain(), "angles": angles}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over pose, twist, wheel angles and the last message."""
        super().restore(state)
        self._reading = OdometryReading.from_plain(state)
        self._left_angle, self._right_angle = map(float, state["angles"])

    def _angles(self) -> tuple[float, float]:
        left, right = self._drive.angle_addresses
        return float(self.kit.data.qpos[left]), float(self.kit.data.qpos[right])

    def _moved(self, left: float, right: float) -> OdometryReading:
        """Return the reading after the wheels' travels (m), taken as an arc."""
        last = self._reading
        forward, turn = (left + right) / 2.0, (right - left) / self._track
        if self.kit.failing == DRIFT:
            turn += self.drift_yaw * abs(forward)
            forward *= 1.0 + self.drift_scale
        # The chord of the arc points along the mean heading.
        heading = last.pose.yaw + turn / 2.0
        pose = Pose2D(
            last.pose.x + forward * math.cos(heading),
            last.pose.y + forward * math.sin(heading),
            wrap_heading(last.pose.yaw + turn),
        )
        time = self.kit.time
        period = time - last.time
        return OdometryReading(time, pose, Twist2D(forward / period, turn / period))
