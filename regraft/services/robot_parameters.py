"""Parameters whose values a component's robot gives: names, units and bounds, once for all components.

The defaults are those of a TurtleBot3 Waffle (ROBOTIS' e-Manual; accelerations as in Nav2's parameters for it). They
hold where a component runs without a robot; a robot that lacks one is refused. docs/robots.md has the list.
"""

from __future__ import annotations

from regraft import Parameter, ParameterError, Records
from regraft.services.power_model import CONSUMERS, MOTION_POWER, Consumer

RADIUS = 0.22
TURNING_ROOM = 0.30
"""m: a Waffle sweeps 0.252 m when it turns."""
OUTLINE = (0.07, 0.20, 0.153)
MAX_VELOCITY, MAX_TURN_RATE = 0.26, 1.82
ACCELERATION, TURN_ACCELERATION = 2.5, 3.2
WHEEL_SPEED, WHEEL_SEPARATION = 0.27, 0.287
BASE_HEIGHT = 0.033
RANGE_MIN, RANGE_MAX = 0.12, 3.5
LIDAR = (-0.064, 0.0, 0.0)
"""m, m, rad: where it is on the base. Range and place are in each scan; these are for scans without a message."""


def radius(*, read_only: bool = False) -> Parameter[float]:
    """Return how near the robot's centre comes to things on a path."""
    return Parameter(
        RADIUS,
        "of the robot, with what it keeps from things",
        minimum=0.01,
        maximum=2.0,
        unit="m",
        read_only=read_only,
        from_robot="radius",
    )


def turning_room(*, read_only: bool = False) -> Parameter[float]:
    """Return how far from things the robot turns in place, with something to spare."""
    return Parameter(
        TURNING_ROOM,
        "how far from things the robot likes to stand, to turn in place",
        minimum=0.01,
        maximum=3.0,
        unit="m",
        read_only=read_only,
        from_robot="turning_room",
    )


def outline() -> Parameter[tuple[float, ...]]:
    """Return the rectangle that the robot is, seen from above."""
    return Parameter(
        OUTLINE,
        "how far it reaches ahead of its axle, behind it, and to each side; empty: a disc of its radius",
        minimum=0.001,
        unit="m",
        read_only=True,
        from_robot="outline",
    )


def check_outline(given: tuple[float, ...]) -> None:
    """Check the value of an `outline`; raises ParameterError."""
    if len(given) not in (0, 3):
        why = "must be [ahead, behind, to each side] in m, or empty for a disc of the radius"
        raise ParameterError([("outline", f"{list(given)}: {why}")])


def velocity_limit() -> Parameter[float]:
    """Return how fast the robot can drive."""
    return Parameter(
        MAX_VELOCITY,
        "how fast the robot can drive",
        minimum=0.001,
        unit="m/s",
        read_only=True,
        from_robot="max_velocity",
    )


def turn_rate_limit() -> Parameter[float]:
    """Return how fast the robot can turn."""
    return Parameter(
        MAX_TURN_RATE,
        "how fast the robot can turn",
        minimum=0.05,
        unit="rad/s",
        read_only=True,
        from_robot="max_turn_rate",
    )


def acceleration() -> Parameter[float]:
    """Return how fast the robot gains and loses speed."""
    return Parameter(
        ACCELERATION,
        "how fast its speed can change",
        minimum=0.001,
        unit="m/s2",
        read_only=True,
        from_robot="acceleration",
    )


def turn_acceleration() -> Parameter[float]:
    """Return how fast the robot gains and loses turning rate."""
    return Parameter(
        TURN_ACCELERATION,
        "how fast its turning rate can change",
        minimum=0.001,
        unit="rad/s2",
        read_only=True,
        from_robot="turn_acceleration",
    )


def wheel_speed() -> Parameter[float]:
    """Return how fast the rim of a wheel can be."""
    return Parameter(
        WHEEL_SPEED,
        "how fast the rim of a wheel can be",
        minimum=0.001,
        unit="m/s",
        read_only=True,
        from_robot="wheel_speed",
    )


def wheel_separation() -> Parameter[float]:
    """Return the distance between the wheels."""
    return Parameter(
        WHEEL_SEPARATION,
        "distance between the wheels",
        minimum=0.001,
        unit="m",
        read_only=True,
        from_robot="wheel_separation",
    )


def base_height() -> Parameter[float]:
    """Return the height of the base's origin."""
    return Parameter(BASE_HEIGHT, "of base_link above the floor", minimum=0.0, unit="m", from_robot="base_height")


def range_max() -> Parameter[float]:
    """Return how far the lidar sees."""
    return Parameter(
        RANGE_MAX, "how far the lidar sees", minimum=0.01, unit="m", read_only=True, from_robot="range_max"
    )


def motion_power() -> Parameter[tuple[float, ...]]:
    """Return the power of the drive by its speed."""
    return Parameter(
        MOTION_POWER,
        "power of the drive by its speed: W standing, W for each m/s, W for each (m/s)2, and so on",
        read_only=True,
        from_robot="motion_power",
    )


def lidar_power() -> Parameter[float]:
    """Return what the lidar draws while its scans are passed on."""
    return Parameter(
        0.0,
        "what the lidar draws while this is active",
        minimum=0.0,
        unit="W",
        read_only=True,
        from_robot="lidar_power",
    )


def depth_camera_power() -> Parameter[float]:
    """Return what the depth camera draws while scans are made of its images."""
    return Parameter(
        0.0,
        "what the depth camera draws while this is active",
        minimum=0.0,
        unit="W",
        read_only=True,
        from_robot="depth_camera_power",
    )


def consumers() -> Records[Consumer]:
    """Return what else draws power all the time."""
    return Records(
        Consumer, "what draws power all the time besides the drive", default=CONSUMERS, from_robot="consumers"
    )
