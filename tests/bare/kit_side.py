"""Components of the kit that the bare component talks with."""

from __future__ import annotations

from typing import Any

from regraft import Component, Input, Output, Parameter, every
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.geometry import Vector3
from regraft.bus_schema.messages.protocol.control import ComponentView, Peer, Rewire, RewireStep
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.lockstep.source import TimeSource


class Lamp(Component):
    """Tells numbered light levels, a hundred times a second."""

    level = Output(LightLevel)
    first = Parameter(1, "the first number", read_only=True)

    def on_configure(self) -> None:
        """Begin before the first number."""
        self.number = self.first - 1

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
    other = Output(LightLevel)

    def advance(self, tick: int, seconds: float) -> None:
        """Publish two levels per tick, the other one with 1000 s on its stamp."""
        now, darkness = self.kit.now(), tick % 8 / 8
        self.level.publish(LightLevel(now, darkness))
        self.other.publish(LightLevel(now + 1000.0, darkness))


class Mover(Component):
    """Moves the bare component's input from ``level`` to ``other`` after a second, as an adaptation manager would."""

    def on_configure(self) -> None:
        """Not yet moved."""
        self.details: list[Any] = []

    @every(seconds=1.0)
    async def move(self) -> None:
        """Move it once, within a slot."""
        if self.details:
            return
        async with self.kit.exclusive() as slot:
            slot.touch("bare")
            await self.rewire("bare", Rewire(RewireStep.OPEN, "light", "other"))
            await self.rewire("sun", Rewire(RewireStep.MARK, topic="other"))
            await self.rewire("bare", Rewire(RewireStep.AWAIT, "light", "other", (Peer("sun", 1),)))
            cut = (await self.rewire("sun", Rewire(RewireStep.MARK, topic="level")))["sequence"]
            await self.rewire("bare", Rewire(RewireStep.SWITCH, "light", "other", cuts={"sun": cut}))

    async def rewire(self, component: str, step: Rewire) -> dict[str, Any]:
        """Ask one step, and remember its detail."""
        key = Keys(self.kit.system).control(component, 1, "connections")
        (answer,) = await self.kit.ask(key, codec.encode(step), 2.0)
        self.details.append(codec.decode(answer.payload, ComponentView).detail)
        last: dict[str, Any] = self.details[-1]
        return last

    def snapshot(self) -> Any:
        """Return the details of all steps."""
        return {"details": self.details}
