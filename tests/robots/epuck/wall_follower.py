"""Follows a wall by infrared alone."""

from __future__ import annotations

import math

from regraft import Component, Input, Output, Parameter
from regraft.bus_schema.messages.devices.ranging import Proximity
from regraft.bus_schema.messages.geometry import Twist

AHEAD, ASLANT, ASIDE = 0.0, math.radians(-49), math.radians(-90)


class WallFollower(Component):
    """Keeps a wall to the robot's right; drives straight on until it finds one."""

    velocity_limit = Parameter(
        0.1, "how fast the robot can drive", minimum=0.001, unit="m/s", read_only=True, from_robot="max_velocity"
    )
    radius = Parameter(0.04, "of the robot", minimum=0.001, unit="m", read_only=True, from_robot="radius")
    gap = Parameter(0.025, "how far its hull keeps from the wall", minimum=0.001, unit="m")
    speed = Parameter(0.07, "how fast it follows", minimum=0.001, unit="m/s", limit="velocity_limit")

    proximity = Input(Proximity, description="what is near")
    velocity = Output(Twist, description="along the wall")

    def on_configure(self) -> None:
        """Begin without a wall."""
        self._found = False

    @proximity.handler
    def on_proximity(self, seen: Proximity) -> None:
        """Turn away from what is ahead, keep the distance to what is aside, turn after a wall that ends."""
        ahead, aslant, aside = (self._towards(seen, bearing) for bearing in (AHEAD, ASLANT, ASIDE))
        self._found |= min(ahead, aslant, aside) < seen.reach
        if ahead < self.gap + 0.01:
            self.velocity.publish(Twist.planar(0.0, 2.0))
        elif not self._found:
            self.velocity.publish(Twist.planar(self.speed, 0.0))
        else:
            # Of a straight wall at the wanted gap, the slanting sensor sees this much.
            expected = (self.radius + self.gap) / math.cos(ASIDE - ASLANT) - self.radius
            off = (self.gap - aside) + (expected - aslant)
            self.velocity.publish(Twist.planar(self.speed, min(max(30.0 * off, -1.5), 1.5)))

    @staticmethod
    def _towards(seen: Proximity, bearing: float) -> float:
        """Return the least distance (m) within 20 degrees of a bearing (rad); the reach if nothing is there."""
        near = [
            float(distance)
            for at, distance in zip(seen.bearings, seen.distances, strict=True)
            if abs(math.remainder(float(at) - bearing, math.tau)) < math.radians(20)
        ]
        return min([seen.reach, *near])
