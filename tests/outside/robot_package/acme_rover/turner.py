"""A component that reads the device."""

import math

from acme_rover.compass import Heading
from regraft import Component, Input, Output, Parameter
from regraft.bus_schema.messages.geometry import Twist, Vector3


class Turner(Component):
    """Turns the robot until its compass shows a direction."""

    heading = Input(Heading, latest_only=True, description="where the robot looks")
    velocity = Output(Twist, description="how it is to turn")

    direction = Parameter(0.0, "where it is to look", unit="rad")
    max_turn_rate = Parameter(0.5, "how fast it may turn", minimum=0.0, unit="rad/s", from_robot="max_turn_rate")

    def on_configure(self) -> None:
        """Begin without having seen a heading."""
        self._previous: Heading | None = None

    @heading.handler
    def turn(self, heading: Heading) -> None:
        """Turn the faster, the farther it is to go; log a heading to which no robot can have turned."""
        self._check(heading)
        error = math.remainder(self.direction - heading.yaw, math.tau)
        rate = max(-self.max_turn_rate, min(2.0 * error, self.max_turn_rate))
        self.velocity.publish(Twist(angular=Vector3(z=rate)))

    def _check(self, heading: Heading) -> None:
        previous, self._previous = self._previous, heading
        if previous is None:
            return
        pause = heading.stamp - previous.stamp
        jump = math.remainder(heading.yaw - previous.yaw, math.tau)
        if abs(jump) > 2.0 * self.max_turn_rate * pause:
            self.kit.log.warning("the compass jumps by %.1f rad at %.1f s", jump, heading.stamp)
