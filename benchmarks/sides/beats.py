"""A component that has something to do in every tick, and next to nothing in it."""

from __future__ import annotations

from regraft import Component, Input, Output, every
from regraft.bus_schema.messages.devices.ranging import Proximity
from regraft.bus_schema.messages.geometry import Twist


class Beat(Component):
    """Looks at what is near and publishes a message, 20 times a second."""

    proximity = Input(Proximity, latest_only=True)
    out = Output(Twist)

    @every(hz=20)
    def beat(self) -> None:
        """Publish what it sees."""
        seen = self.proximity.latest
        self.out.publish(Twist.planar(seen.reach if seen else 0.0, 0.0))
