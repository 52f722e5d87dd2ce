"""The contacts by which a robot takes power from a dock."""

import math

from regraft import Output, Parameter
from regraft.bus_schema.messages.power import ChargerState
from regraft.sim_service.devices.core.sensor import Sensor


class Charger(Sensor):
    """Reports whether the robot stands on the dock of the world, and the power that the dock gives. A world may have
    none.
    """

    measures = "charger"

    charger = Output(ChargerState, description="whether the robot stands on the dock; nothing in worlds without one")

    dock = Parameter("dock", "the MJCF site of the world that is the dock", read_only=True)
    rate = Parameter(2.0, "measurements per second", minimum=0.1, unit="Hz", read_only=True)
    power = Parameter(20.0, "what the dock gives", minimum=0.0, unit="W")
    reach = Parameter(0.15, "how near to the dock the robot is charged", minimum=0.01, unit="m")

    def build(self) -> None:
        """Find the dock, if the world has one."""
        scene = self.kit.scene
        self._dock = scene.index("site", self.dock) if self.dock in scene.names("site") else None

    def distance(self) -> float | None:
        """Return how far (m, on the ground) the robot's base is from the dock; None if the world has none."""
        if self._dock is None:
            return None
        data = self.kit.data
        away = data.site_xpos[self._dock] - data.xpos[self.kit.base]
        return math.hypot(float(away[0]), float(away[1]))

    def sense(self) -> None:
        """Publish the state of the charger, in a world that has a dock."""
        if self._dock is not None:
            super().sense()

    def measure(self) -> ChargerState:
        """Return whether the robot is charged now."""
        distance = self.distance()
        connected = distance is not None and distance <= self.reach
        return ChargerState(self.kit.stamp, connected, self.power if connected else 0.0)
