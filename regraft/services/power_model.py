"""The power that the robot's parts draw.

The numbers are those of FROG (ReBeT, E. G. Alberts et al., ACSOS 2024), which follows L. Jaiem et al. with a
similar robot. A robot's file may give others: docs/robots.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Text, Unit

MOTION_POWER = (3.66, 9.79, 6.25)
"""W of the drive standing, W for each m/s, and W for each (m/s)²."""
LIDAR_POWER = 2.34
"""W, while it turns."""
IDLE_POWER = 1.14
"""W, for all that is always on."""
PICTURE_ENERGY = 59.275
"""J, to take one on-board picture and look for objects in it."""


@dataclass(frozen=True, slots=True)
class Consumer:
    """A part of a robot that draws the same power all the time."""

    name: Annotated[str, Text(64)]
    power: Annotated[float, Unit("W"), Bounds(minimum=0.0)]


CONSUMERS = (Consumer("lidar", LIDAR_POWER), Consumer("idle", IDLE_POWER))


def motion_power(speed: float, coefficients: Sequence[float] = MOTION_POWER) -> float:
    """Return the power (W) of the drive at a speed (m/s): a polynomial in it, the constant term first."""
    speed, power = abs(speed), 0.0
    for degree in reversed(range(len(coefficients))):
        power += coefficients[degree] * speed**degree
    return power


def constant_power(consumers: Iterable[Consumer] = CONSUMERS) -> float:
    """Return the power (W) of all that is always on."""
    return math.fsum(consumer.power for consumer in consumers)


def total_power(
    speed: float, coefficients: Sequence[float] = MOTION_POWER, consumers: Iterable[Consumer] = CONSUMERS
) -> float:
    """Return the power (W) of the whole robot at a speed (m/s), pictures left out."""
    return motion_power(speed, coefficients) + constant_power(consumers)
