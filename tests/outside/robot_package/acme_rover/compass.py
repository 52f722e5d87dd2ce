"""A device of our own, and the message that it publishes."""

import math
from dataclasses import dataclass

from regraft import Output, Parameter
from regraft.bus_schema.annotations import Radians, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.sim_service.devices.core.failure_schedule import BIAS
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter


@message("acme/Heading")
@dataclass(frozen=True, slots=True)
class Heading:
    """Where the robot looks in the map, counter-clockwise from the x axis."""

    stamp: Seconds
    yaw: Radians


class Compass(Sensor):
    """Measures the direction of its site's x axis."""

    measures = "heading"

    heading = Output(Heading, description="where the robot looks")

    site = Parameter("compass", "the MJCF site where it is", read_only=True)
    noise = Parameter(0.01, "standard deviation", minimum=0.0, unit="rad")
    failure = failure_parameter(BIAS)
    bias = Parameter(0.5, "what a bias adds", unit="rad")

    def build(self) -> None:
        """Find the site."""
        self._site = self.kit.index("site", self.site)

    def measure(self) -> Heading:
        """Return the direction with its noise, spoiled by what fails."""
        kit = self.kit
        axes = kit.data.site_xmat[self._site]
        yaw = math.atan2(float(axes[3]), float(axes[0]))
        yaw += self.noise * float(kit.random(kit.name, kit.progress.tick).standard_normal())
        yaw += self.bias if kit.failing == BIAS else 0.0
        return Heading(kit.stamp, math.remainder(yaw, math.tau))
