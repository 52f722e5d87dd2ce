"""How well driving is expected to go, without driving."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from regraft.services import robot_parameters as usual
from regraft.services.power_model import MOTION_POWER, motion_power

NEAR_SHARE = 0.1
"""Of the lidar's range: an obstacle within it is near (FROG, requirement B1-1)."""
SLOW = 0.18
"""m/s: slower is safe also near obstacles."""
TURNING = 4.5
"""s of a drive from pose to pose that go into turning, speeding up and slowing down, in FROG's room."""


def near_of(range_min: float, range_max: float, share: float = NEAR_SHARE) -> float:
    """Return how near (m) is near to a lidar that measures from ``range_min`` to ``range_max`` (m)."""
    return range_min + share * (range_max - range_min)


NEAR = near_of(usual.RANGE_MIN, usual.RANGE_MAX)
"""m: 0.458."""


@dataclass(frozen=True, slots=True)
class Caution:
    """How a controller drives where obstacles are near.

    ``near`` is the share of the time that one is within `NEAR` in FROG's room. ``full`` is the share of that time at
    full speed. The rest is spread evenly over the lower speeds down to standing.
    """

    near: float
    full: float

    def safety(self, max_velocity: float, near: float | None = None, slow: float = SLOW) -> float:
        """Return the expected share of the time in which nothing is `NEAR` or the speed is below ``slow`` (m/s).

        That is 1 - near * P(speed >= slow), and P = full + (1 - full) * (1 - slow / max_velocity). It is 1 as long as
        the robot may not drive that fast. From there it falls with max_velocity.
        """
        if max_velocity < slow:
            return 1.0
        # Where even standing is not slow, max_velocity may be 0.
        fast = self.full + (1.0 - self.full) * (1.0 - slow / max_velocity) if slow > 0.0 else 1.0
        return 1.0 - (self.near if near is None else near) * fast


# Measured on FROG's goals in six rooms, at 0.18, 0.22 and 0.26 m/s (tests/evidence/sensing/test_navigator.py).
ROLLOUTS = Caution(near=0.08, full=0.77)
PURSUIT = Caution(near=0.08, full=0.08)


def is_near(clearance: float, near: float = NEAR) -> bool:
    """Return whether the nearest echo, at ``clearance`` (m), is near."""
    return clearance < near


def is_safe(clearance: float, speed: float, near: float = NEAR, slow: float = SLOW) -> bool:
    """Return whether it is safe to drive at ``speed`` (m/s) with the nearest echo at ``clearance`` (m).

    That is the one definition of FROG's requirement MoveSafely: nothing is nearer than ``near`` (m), or the speed is
    below ``slow`` (m/s).
    """
    return not is_near(clearance, near) or abs(speed) < slow


def drive_time(distance: float, speed: float) -> float:
    """Return how long (s) a drive over a distance (m) takes at a speed (m/s) above 0; none if there is no way."""
    return distance / speed + TURNING if distance > 0.0 else 0.0


def drive_energy(distance: float, speed: float, powers: Sequence[float] = MOTION_POWER) -> float:
    """Return what the wheels take (J) for a drive over a distance (m) at a speed (m/s) above 0."""
    turning = TURNING if distance > 0.0 else 0.0
    return distance / speed * motion_power(speed, powers) + turning * motion_power(0.0, powers)


def driving_qualities(
    max_velocity: float,
    caution: Caution,
    near: float | None = None,
    powers: Sequence[float] = MOTION_POWER,
    slow: float = SLOW,
) -> dict[str, float]:
    """Return speed (m/s), power (W), safety, and energy per metre (J/m) if it moves, at the speed allowed.

    ``powers`` are the coefficients of the drive's power. Driving below ``slow`` (m/s) is safe.
    """
    power = motion_power(max_velocity, powers)
    qualities = {"speed": max_velocity, "power": power, "safety": caution.safety(max_velocity, near, slow)}
    return qualities | ({"energy_per_metre": power / max_velocity} if max_velocity > 0.0 else {})
