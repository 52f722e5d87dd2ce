"""The base of components that stand for a device: they book the energy that it draws."""

from __future__ import annotations

from regraft import Component, Output, Parameter, Quality, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.power import EnergyUse


class PoweredComponent(Component):
    """Books what the device behind it draws while it is active; a subclass has the robot's value as ``power``."""

    power = Parameter(0.0, "what the device draws while this is active", minimum=0.0, unit="W", read_only=True)

    drawn_power = Quality("of the device while this is active", unit="W", better="lower", minimum=0.0, name="power")

    energy = Output(EnergyUse, required=False, description="what the device has drawn since the last message")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``power`` (W) that the device draws while this is active."""
        return {"power": float(parameters.get("power", cls.power.default))}

    def evaluate(self) -> dict[str, float]:
        """Return the ``power`` (W) that the device draws now."""
        return {"power": self.power}

    def on_activate(self) -> None:
        """Switch the device on: it draws from now on."""
        self._booked_until = self.kit.now()

    def on_deactivate(self) -> None:
        """Switch the device off: it has drawn until now."""
        self.book()

    @every(hz=2.0)
    def book(self) -> None:
        """Publish the energy that the device has drawn since the last time."""
        now = self.kit.now()
        seconds, self._booked_until = now - self._booked_until, now
        if self.power > 0.0 and seconds > 0.0:
            self.energy.publish(EnergyUse(now, self.kit.name, self.power * seconds))
