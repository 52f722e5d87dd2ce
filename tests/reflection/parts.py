"""Sources of what is reflected, and a stack of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from regraft import Component, Input, Output, Parameter, Records, every
from regraft.bus_schema.annotations import Bounds
from regraft.bus_schema.messages.geometry import Pose, Twist, Vector3
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import LightLevel, Odometry


def battery_state(stamp: float, charge: float) -> BatteryState:
    """Return how full a battery is."""
    return BatteryState(stamp, 2000.0 * charge, 2000.0, charge, 7.0)


def odometry_of(stamp: float, speed: float) -> Odometry:
    """Return how fast a robot drives."""
    return Odometry(stamp, "odom", "base", Pose(), Twist(Vector3(speed, 0.0, 0.0)))


class Battery(Component):
    """Empties by a hundredth of what it can hold, again and again."""

    battery = Output(BatteryState)
    rate = Parameter(20.0, "how often it tells", unit="Hz")

    def on_configure(self) -> None:
        """Begin full."""
        self.told = 0

    @every(hz=rate)
    def tell(self) -> None:
        """Tell."""
        self.told += 1
        self.battery.publish(battery_state(self.kit.now(), 1.0 - self.told % 100 / 100.0))


class Wheels(Component):
    """Drives at a speed."""

    odometry = Output(Odometry)
    speed = Parameter(0.2, "how fast", unit="m/s")

    @every(hz=20)
    def tell(self) -> None:
        """Tell."""
        self.odometry.publish(odometry_of(self.kit.now(), self.speed))


class Lamp(Component):
    """Says how dark it is."""

    light = Output(LightLevel)

    @every(hz=20)
    def tell(self) -> None:
        """Tell."""
        self.light.publish(LightLevel(self.kit.now(), 0.25))


@dataclass(frozen=True, slots=True)
class Ear:
    """What one ear hears."""

    name: str
    topic: str
    loudness: Annotated[float, Bounds(0.0, 1.0)] = 0.5


class Listener(Component):
    """Has an ear, and an echo, for each record; what a class with ports by parameters looks like."""

    ears = Records(Ear, "what is listened to")
    prefix = Parameter("", "how all ears' names begin", read_only=True)
    pitch = Parameter(1.0, "not fixed at the start")
    told = Output(LightLevel, required=False)

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any] | Output[Any]]:
        """Name two ports per ear."""
        assert "pitch" not in parameters, "ports depend on what cannot change"
        for index, ear in enumerate(parameters["ears"]):
            name, origin = parameters["prefix"] + ear.name, f"ears.{index}"
            yield Input(LightLevel, name=name, topic=ear.topic, origin=origin, required=False)
            yield Output(LightLevel, name=f"{name}_echo", topic=f"{ear.topic}/echo", origin=origin)

    @every(hz=1)
    def echo(self) -> None:
        """Repeat what was heard."""
        for ear in self.ears:
            heard = self.kit.inputs[self.prefix + ear.name].latest
            if heard is not None:
                self.kit.outputs[f"{self.prefix}{ear.name}_echo"].publish(
                    LightLevel(self.kit.now(), heard.darkness * ear.loudness)
                )
