"""Components of the kit that the bare component talks with."""

from __future__ import annotations

from typing import Any

from bus_schema.messages.geometry import Vector3
from bus_schema.messages.sensors import LightLevel
from regraft import Component, Input, Output, every
from regraft.stepped.source import TimeSource


class Lamp(Component):
    """Tells numbered light levels, a hundred times a second."""

    level = Output(LightLevel)

    def on_configure(self) -> None:
        """Begin with number 1."""
        self.number = 0

    @every(hz=100)
    def tell(self) -> None:
        """Publish the next level; its stamp is its number."""
        self.number += 1
        self.level.publish(LightLevel(float(self.number), self.number % 10 / 10))

    def snapshot(self) -> Any:
        """Return how many levels were told."""
        return {"told": self.number}


class Recorder(Component):
    """Remembers what it reads, with the time at which it came."""

    echo = Input(LightLevel)
    count = Input(Vector3)

    def on_configure(self) -> None:
        """Begin with nothing."""
        self.echoes: list[list[float]] = []
        self.counts: list[list[float]] = []

    @echo.handler
    def on_echo(self, level: LightLevel) -> None:
        """Remember an echo."""
        self.echoes.append([level.stamp, level.darkness, self.kit.now()])

    @count.handler
    def on_count(self, count: Vector3) -> None:
        """Remember a count."""
        self.counts.append([count.x, self.kit.now()])

    def snapshot(self) -> Any:
        """Return all of it."""
        return {"echoes": self.echoes, "counts": self.counts}


class Asker(Component):
    """Calls the bare component's service, five times a second."""

    def on_configure(self) -> None:
        """Begin with nothing."""
        self.answers: list[list[float]] = []

    @every(hz=5)
    async def ask(self) -> None:
        """Call, and remember when it was asked, when it was answered, and what."""
        asked = self.kit.now()
        reply = await self.kit.call("invert", LightLevel(asked, 0.25), LightLevel)
        self.answers.append([asked, self.kit.now(), reply.darkness])

    def snapshot(self) -> Any:
        """Return the answers."""
        return {"answers": self.answers}


class Sun(TimeSource):
    """A world in which nothing happens but light."""

    level = Output(LightLevel)

    def advance(self, tick: int, seconds: float) -> None:
        """Publish a level per tick."""
        self.level.publish(LightLevel(self.kit.now(), tick % 8 / 8))
