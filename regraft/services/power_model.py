"""The power that the robot's parts draw.

The numbers are those of FROG (ReBeT, E. G. Alberts et al., ACSOS 2024), which follows L. Jaiem et al. with a
similar robot.
"""

from __future__ import annotations

LIDAR_POWER = 2.34
"""W, while it turns."""
IDLE_POWER = 1.14
"""W, for all that is always on."""
PICTURE_ENERGY = 59.275
"""J, to take one on-board picture and look for objects in it."""


def motion_power(speed: float) -> float:
    """Return the power (W) of the drive at a speed (m/s): standing, it still takes 3.66 W."""
    speed = abs(speed)
    return 6.25 * speed**2 + 9.79 * speed + 3.66


def total_power(speed: float) -> float:
    """Return the power (W) of the whole robot at a speed (m/s), pictures left out."""
    return motion_power(speed) + LIDAR_POWER + IDLE_POWER
