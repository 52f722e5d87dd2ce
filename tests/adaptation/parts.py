"""Small components that the promises are tested on."""

from __future__ import annotations

import threading
from typing import ClassVar

from bus_schema.messages.geometry import Twist, Vector3
from bus_schema.messages.sensors import LaserScan
from regraft import Component, Input, Output, Parameter, every


class Talker(Component):
    """Counts aloud."""

    numbers = Output(Twist)
    rate = Parameter(1000.0, minimum=0.0, maximum=5000.0, unit="Hz")
    sent: int = 0

    @every(hz=rate)
    def talk(self) -> None:
        """Say the next number."""
        self.sent += 1
        self.numbers.publish(Twist(Vector3(float(self.sent))))


class Listener(Component):
    """Remembers what it hears, of whom."""

    heard = Input(Twist, topic="numbers")
    hint = Input(Twist, topic="hints", required=False)
    gain = Parameter(0.5, minimum=0.0, maximum=1.0)
    label = Parameter("plain", choices=("plain", "fancy"))
    fixed = Parameter(1, read_only=True)

    def on_configure(self) -> None:
        """Forget everything."""
        self.log: list[tuple[str, int]] = []

    @heard.handler
    def hear(self, message: Twist) -> None:
        """Remember a number."""
        envelope = self.heard.envelope
        assert envelope is not None
        self.log.append((envelope.source, int(message.linear.x)))


class Fragile(Component):
    """Breaks where it is told to: its ``release`` lets a hung one go on."""

    heard = Input(Twist, topic="numbers", required=False)
    level = Parameter(0, minimum=0, maximum=10)
    mood = Parameter("well", choices=("well", "refuses", "hangs", "fails"))
    release: ClassVar[threading.Event] = threading.Event()

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Refuse or hang, as the mood is."""
        if self.mood == "refuses" and "level" in changed:
            raise ValueError("not in this mood")
        if self.mood == "hangs" and "level" in changed:
            self.release.wait(10.0)

    def on_activate(self) -> None:
        """Fail, as the mood is."""
        if self.mood == "fails":
            raise RuntimeError("cannot be activated in this mood")


class Scanner(Component):
    """Writes a topic of another type."""

    scan = Output(LaserScan)
