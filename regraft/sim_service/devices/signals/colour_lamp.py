"""A coloured lamp that cameras see."""

from collections.abc import Mapping
from typing import Any

from regraft import Input, Parameter
from regraft.bus_schema.messages.devices.signals import Colour
from regraft.sim_service.cameras.camera import Rgb
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.failure_schedule import BLACK, FROZEN, NONE


class ColourLamp(Device):
    """Makes a geom of the robot shine in the colour of the last command; it lights nothing around it.

    While it is off, the geom looks as in its MJCF. A black lamp is off at any command, a frozen one keeps its colour.
    """

    colour = Input(Colour, description="the colour to shine in", required=False)

    geom = Parameter("lamp", "the MJCF geom that shines", read_only=True)
    failure = Parameter(NONE, "how it fails now", choices=(NONE, BLACK, FROZEN))

    def build(self) -> None:
        """Find the geom; raises SceneError."""
        self._geom = self.kit.index("geom", self.geom)
        self._shown = Colour()

    @colour.handler
    def on_colour(self, colour: Colour) -> None:
        """Shine in a colour from now on."""
        if self.kit.failing != FROZEN:
            self._shown = colour

    def colours(self) -> dict[int, Rgb]:
        """Return the colour of the geom, if it shines."""
        shown = self._shown
        if self.kit.failing == BLACK or shown == Colour():
            return {}
        return {self._geom: (shown.red, shown.green, shown.blue)}

    def snapshot(self) -> dict[str, Any]:
        """Return the colour of the last command."""
        return {"colour": [self._shown.red, self._shown.green, self._shown.blue]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over the colour."""
        self._shown = Colour(*map(float, state["colour"]))
