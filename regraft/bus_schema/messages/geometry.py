"""Positions, orientations and velocities: SI units, radians, right-handed axes as in REP 103, frames as in REP 105."""

from __future__ import annotations

import math
from dataclasses import dataclass

from regraft.bus_schema.annotations import Metres, MetresPerSecond, Radians, RadiansPerSecond, Seconds
from regraft.bus_schema.encoding.registry import message

ROUNDED = 1e-6
"""How far the length of a unit quaternion may be from 1."""


@message("regraft/Vector3")
@dataclass(frozen=True, slots=True)
class Vector3:
    """A vector; its unit and frame are those of the field that holds it."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@message("regraft/Quaternion")
@dataclass(frozen=True, slots=True)
class Quaternion:
    """A rotation as a unit quaternion, scalar last."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @classmethod
    def from_yaw(cls, yaw: Radians) -> Quaternion:
        """Return the rotation by ``yaw`` about z."""
        return cls(z=math.sin(yaw / 2), w=math.cos(yaw / 2))

    @property
    def yaw(self) -> Radians:
        """The rotation about z, in (-pi, pi]; that of a quaternion of another length is the same, 0 for length 0."""
        x, y, z, w = self.x, self.y, self.z, self.w
        length = math.hypot(x, y, z, w)
        if length and abs(length - 1.0) > ROUNDED:
            x, y, z, w = x / length, y / length, z / length, w / length
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))


@message("regraft/Pose")
@dataclass(frozen=True, slots=True)
class Pose:
    """Position (m) and orientation of one frame in another; the frames are those of the message that holds it."""

    position: Vector3 = Vector3()
    orientation: Quaternion = Quaternion()

    @classmethod
    def planar(cls, x: Metres, y: Metres, yaw: Radians) -> Pose:
        """Return a pose in the plane z = 0."""
        return cls(Vector3(x, y), Quaternion.from_yaw(yaw))

    @property
    def x(self) -> Metres:
        """The position along x."""
        return self.position.x

    @property
    def y(self) -> Metres:
        """The position along y."""
        return self.position.y

    @property
    def yaw(self) -> Radians:
        """The rotation about z, in (-pi, pi]."""
        return self.orientation.yaw


@message("regraft/FramedPose")
@dataclass(frozen=True, slots=True)
class FramedPose:
    """A pose in a named frame, such as ``map``."""

    frame: str
    pose: Pose


@message("regraft/StampedPose")
@dataclass(frozen=True, slots=True)
class StampedPose:
    """A pose in a named frame, and when it was given."""

    stamp: Seconds
    frame: str
    pose: Pose


@message("regraft/Twist")
@dataclass(frozen=True, slots=True)
class Twist:
    """Linear (m/s) and angular (rad/s) velocity of a body, in its own frame: x forward, y left, z up."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()

    @classmethod
    def planar(cls, forward: MetresPerSecond, turn: RadiansPerSecond) -> Twist:
        """Return the velocity of a body that drives forward and turns left about z."""
        return cls(Vector3(x=forward), Vector3(z=turn))

    @property
    def forward(self) -> MetresPerSecond:
        """The linear velocity along x."""
        return self.linear.x

    @property
    def turn(self) -> RadiansPerSecond:
        """The angular velocity about z."""
        return self.angular.z
