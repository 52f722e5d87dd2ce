"""Components whose ports need not be connected."""

from __future__ import annotations

from regraft import Component, Input, Output, Parameter, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Twist, Vector3

HERE = "tests.adaptation.optional_ports"


class Voice(Component):
    """Counts aloud, to whoever listens."""

    numbers = Output(Twist, required=False)
    rate = Parameter(200.0, minimum=0.0, maximum=5000.0, unit="Hz")
    sent: int = 0

    @every(hz=rate)
    def talk(self) -> None:
        self.numbers.publish(Twist(Vector3(float(self.sent + 1))))
        self.sent += 1


class Ear(Component):
    """Remembers all numbers that it hears, and continues with them in its successor."""

    heard = Input(Twist, topic="numbers", required=False)
    gain = Parameter(1.0)
    state_version = 1

    def __init__(self) -> None:
        self.log: list[int] = []

    @heard.handler
    def hear(self, message: Twist) -> None:
        self.log.append(int(message.linear.x))

    def snapshot(self) -> PlainValue:
        return {"log": list(self.log)}

    def restore(self, state: PlainValue) -> None:
        self.log = [int(number) for number in state["log"]]


class OtherEar(Ear):
    """Takes an ear's place."""
