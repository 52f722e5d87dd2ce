"""Measurements of sensors. ``stamp`` is when the measurement was taken, on the stack's clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Array, ByteArray, FloatArray, Lux, Metres, Radians, Ratio, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Pose, Quaternion, Twist, Vector3


@message("regraft/Odometry")
@dataclass(frozen=True, slots=True)
class Odometry:
    """Pose of ``child_frame`` in ``frame`` (REP 105: odom drifts, never jumps) and its velocity in ``child_frame``."""

    stamp: Seconds
    frame: str
    child_frame: str
    pose: Pose
    twist: Twist


@message("regraft/LaserScan")
@dataclass(frozen=True, slots=True)
class LaserScan:
    """One turn of a planar lidar: beam i looks along ``angle_min + i * angle_increment`` about z of ``frame``.

    ``ranges`` in metres, +inf where nothing was hit within ``range_max``, -inf where something is nearer than
    ``range_min`` (REP 117). ``pose`` is where the lidar sits on ``base_frame``.
    """

    stamp: Seconds
    frame: str
    base_frame: str
    pose: Pose
    angle_min: Radians
    angle_increment: Radians
    range_min: Metres
    range_max: Metres
    ranges: Annotated[FloatArray, Array("<f4", (None,))]


@message("regraft/Image")
@dataclass(frozen=True, slots=True)
class Image:
    """A colour image, 8 bits a channel, rows from the top, channels red, green, blue; shape (height, width, 3).

    ``frame`` is the camera's optical frame (REP 103, x right, y down, z forward). ``pose`` is where the camera's body
    frame (x forward, y left) sits in ``pose_frame``. ``horizontal_field_of_view`` is its opening angle.
    """

    stamp: Seconds
    frame: str
    pose_frame: str
    pose: Pose
    horizontal_field_of_view: Radians
    pixels: Annotated[ByteArray, Array("|u1", (None, None, 3), tail=True)]

    def __post_init__(self) -> None:
        if not 0.0 < self.horizontal_field_of_view < 3.1:
            raise BadMessage("must lie between 0 and 3.1 rad", ("horizontal_field_of_view",))


@message("regraft/DepthImage")
@dataclass(frozen=True, slots=True)
class DepthImage:
    """Depths (m) along the optical axis, rows from the top; shape (height, width). As in REP 118, it has no colours.

    A depth is +inf where nothing is within ``range_max``, and -inf where something is nearer than ``range_min``.
    ``frame``, ``pose_frame``, ``pose`` and ``horizontal_field_of_view`` are as in ``regraft/Image``.
    """

    stamp: Seconds
    frame: str
    pose_frame: str
    pose: Pose
    horizontal_field_of_view: Radians
    range_min: Metres
    range_max: Metres
    depths: Annotated[FloatArray, Array("<f4", (None, None), tail=True)]

    def __post_init__(self) -> None:
        if not 0.0 < self.horizontal_field_of_view < 3.1:
            raise BadMessage("must lie between 0 and 3.1 rad", ("horizontal_field_of_view",))


@message("regraft/LightLevel")
@dataclass(frozen=True, slots=True)
class LightLevel:
    """How dark it is for the on-board camera: 0 is full light, 1 is black."""

    stamp: Seconds
    darkness: Ratio


@message("regraft/Illuminance")
@dataclass(frozen=True, slots=True)
class Illuminance:
    """How much light falls on a sensor that faces along x of ``frame``."""

    stamp: Seconds
    frame: str
    illuminance: Lux


@message("regraft/Imu")
@dataclass(frozen=True, slots=True)
class Imu:
    """Angular velocity (rad/s) and specific force (m/s2) in ``frame``, and the orientation of ``frame`` in the map.

    The specific force is the acceleration less that of gravity: at rest it is 9.81 m/s2 along what is up. The
    orientation is None where the sensor does not give any.
    """

    stamp: Seconds
    frame: str
    angular_velocity: Vector3
    specific_force: Vector3
    orientation: Quaternion | None = None
