"""The algorithms' model of the robot: its outline and what its drive can do."""

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from regraft.planar import Twist2D
from regraft.services import robot_parameters as usual

Floats = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True)
class Footprint:
    """Rectangular outline seen from above, in the base frame (origin on the axle's centre), in m.

    `rounding` is the radius of its corners: a disc is a square that is rounded altogether.
    """

    front: float = usual.OUTLINE[0]
    rear: float = usual.OUTLINE[1]
    half_width: float = usual.OUTLINE[2]
    rounding: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.rounding <= min((self.front + self.rear) / 2, self.half_width):
            raise ValueError(f"corners of {self.rounding} m do not fit into an outline of {self}")

    @classmethod
    def disc(cls, radius: float) -> Self:
        """Return the outline of a round robot, whose axle goes through its middle."""
        return cls(radius, radius, radius, radius)

    @property
    def circumradius(self) -> float:
        """Radius (m) of the disc that the outline sweeps when the robot turns in place."""
        corner = self.rounding
        return math.hypot(max(self.front, self.rear) - corner, self.half_width - corner) + corner

    @property
    def centre(self) -> float:
        """Where the outline's middle is, in m ahead of the axle's."""
        return (self.front - self.rear) / 2

    def nearest(self, x: Floats, y: Floats) -> Floats:
        """Return the distance (m) from the outline to the nearest of some points.

        `x` and `y` (..., M) hold the points along the last axis, at least one, as seen from the outline's
        `centre`. The distance is negative where a point is inside. Both arrays are overwritten: they are large in
        a control loop.
        """
        half_length, half_width = (self.front + self.rear) / 2 - self.rounding, self.half_width - self.rounding
        for beyond, half in ((x, half_length), (y, half_width)):
            np.abs(beyond, out=beyond)
            beyond -= half
        squares, squares_y = np.maximum(x, 0.0), np.maximum(y, 0.0)
        squares *= squares
        squares_y *= squares_y
        squares += squares_y
        distance: Floats = np.sqrt(squares.min(axis=-1))
        if distance.min() <= 0.0:
            depth = np.maximum(x, y).min(axis=-1)
            distance = np.where(depth < 0.0, depth, distance)
        distance -= self.rounding
        return distance


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of the differential drive.

    Velocities are in m/s and rad/s, accelerations in m/s² and rad/s². The speed of each wheel's rim is in m/s, the
    distance between the wheels in m. `max_velocity` may be 0: the robot then only turns.
    """

    max_velocity: float = usual.MAX_VELOCITY
    max_turn_rate: float = 1.0
    acceleration: float = usual.ACCELERATION
    turn_acceleration: float = usual.TURN_ACCELERATION
    wheel_speed: float = usual.WHEEL_SPEED
    track: float = usual.WHEEL_SEPARATION

    def __post_init__(self) -> None:
        if not self.max_velocity >= 0.0:
            raise ValueError(f"max_velocity must be at least 0 m/s, not {self.max_velocity}")
        for name in ("max_turn_rate", "acceleration", "turn_acceleration", "wheel_speed", "track"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be greater than 0, not {getattr(self, name)}")

    def saturate(self, twist: Twist2D) -> Twist2D:
        """Scale v and w together until neither a wheel nor a limit is exceeded; the curvature stays."""
        fastest_wheel = abs(twist.v) + abs(twist.w) * self.track / 2
        scale = min(
            1.0,
            self.wheel_speed / fastest_wheel if fastest_wheel else 1.0,
            self.max_velocity / abs(twist.v) if twist.v else 1.0,
            self.max_turn_rate / abs(twist.w) if twist.w else 1.0,
        )
        return Twist2D(twist.v * scale, twist.w * scale)

    def approach(self, current: Twist2D, target: Twist2D, period: float) -> Twist2D:
        """Return the twist nearest to `target` that can be reached from `current` in `period` seconds."""
        most_v, most_w = self.acceleration * period, self.turn_acceleration * period
        v = min(max(target.v, current.v - most_v), current.v + most_v)
        w = min(max(target.w, current.w - most_w), current.w + most_w)
        return self.saturate(Twist2D(v, w))
