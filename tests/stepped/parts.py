"""A tiny world and what lives in it."""

from __future__ import annotations

import hashlib
import random
import time
from dataclasses import dataclass

from regraft import Component, Input, Output, Parameter, every, service
from regraft.bus_schema.annotations import Count
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.model.lifecycle import Transition
from regraft.lockstep.source import TimeSource


@message("stepped_tests/Reading")
@dataclass(frozen=True, slots=True)
class Reading:
    """A value, and when it was taken."""

    stamp: float
    value: float


@message("stepped_tests/Text")
@dataclass(frozen=True, slots=True)
class Text:
    """Some text."""

    text: str = ""
    number: Count = 0


class TinyWorld(TimeSource):
    """A point on a line that is pushed."""

    push = Input(Reading, required=False)
    position = Output(Reading)

    def __init__(self) -> None:
        self.x = 0.0
        self.v = 0.0
        self.ticks = 0

    @push.handler
    def pushed(self, push: Reading) -> None:
        self.v = push.value

    def advance(self, tick: int, seconds: float) -> None:
        self.ticks += 1
        self.x += self.v * seconds
        self.position.publish(Reading(self.kit.now(), self.x))


class Pusher(Component):
    """Pushes the point to where it should be; asks the adviser how hard."""

    position = Input(Reading)
    push = Output(Reading)
    goal = Parameter(3.0)

    def __init__(self) -> None:
        self.dice = random.Random("pusher")

    @every(hz=10)
    async def steer(self) -> None:
        now = self.kit.now()
        seen = self.position.latest
        if seen is None:
            return
        advice = await self.kit.call("advise", Reading(now, self.goal - seen.value), Reading)
        assert self.kit.now() == now, "a call takes no simulated time"
        self.push.publish(Reading(now, advice.value + self.dice.gauss(0.0, 0.01)))


class Adviser(Component):
    """Advises, after heavy work."""

    @service("advise")
    async def advise(self, question: Reading) -> Reading:
        return Reading(self.kit.now(), await self.kit.compute(_think, question.value))


def _think(value: float) -> float:
    time.sleep(0.0005)
    return value * 0.5


class Witness(Component):
    """Writes down all that happens, without being woken by it."""

    position = Input(Reading, keep=10_000)
    push = Input(Reading, keep=10_000, required=False)

    def __init__(self) -> None:
        self.seen: list[tuple[str, float, float]] = []

    @every(seconds=0.5)
    def write(self) -> None:
        self.seen += [("position", r.stamp, r.value) for r in self.position.take()]
        self.seen += [("push", r.stamp, r.value) for r in self.push.take()]

    def digest(self) -> str:
        return hashlib.sha256(repr(self.seen).encode()).hexdigest()


class Sleeper(Component):
    """Notes when it is activated; nothing wakes it before."""

    def __init__(self) -> None:
        self.activated: list[float] = []

    def on_activate(self) -> None:
        self.activated.append(self.kit.now())


class Waker(Component):
    """Activates the sleeper, as the adaptation manager would, and notes when."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    @every(seconds=3.0)
    async def wake(self) -> None:
        async with self.kit.exclusive():
            now = self.kit.now()
            order = SetTransition(Transition.ACTIVATE, time=round(now * 1e9))
            answers = await self.kit.ask(f"{self.kit.system}/component/sleeper/1/transition", codec.encode(order), 2.0)
            self.asked += [now for answer in answers if not answer.error]


class Clerk(Component):
    """Works in exclusive slots, and answers anybody."""

    def __init__(self) -> None:
        self.slots: list[float] = []
        self.log: list[str] = []

    @every(seconds=1.0)
    async def work(self) -> None:
        began = self.kit.now()
        async with self.kit.exclusive():
            self.slots.append(self.kit.now() - began)
            key = f"{self.kit.system}/component/pusher/*/describe"
            answers = await self.kit.ask(key, b"", 2.0)
            self.log.append(f"{len(answers)} at {self.kit.now()}")

    @service("file")
    def file(self, text: Text) -> Text:
        return Text(text.text.upper(), round(self.kit.now() * 1000))
