"""Small components for the kit's tests."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

from regraft import Cancelled, Component, Input, Output, Parameter, Quality, RequestRefused, action, every, service
from regraft.bus_schema.annotations import Count, PlainValue, Ratio
from regraft.bus_schema.encoding.registry import message
from tests.support.waiting import PATIENCE


@message("kit_tests/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """A number that a test sends around."""

    value: Count
    share: Ratio = 0.0


@message("kit_tests/Other")
@dataclass(frozen=True, slots=True)
class Other:
    """Something that is no number."""

    text: str = ""


class Speechless(Exception):
    """Has a text that cannot be had: it reads what nobody has set."""

    device: str

    def __str__(self) -> str:
        return f"{self.device} does not answer"


class Echo(Component):
    """Says again what it hears."""

    heard = Input(Number)
    said = Output(Number)

    @heard.handler
    def say(self, number: Number) -> None:
        self.said.publish(number)


class Gated(Component):
    """Says again what it hears; from 100 on, only when it is let through."""

    heard = Input(Number)
    said = Output(Number)

    def __init__(self) -> None:
        self.entered = threading.Semaphore(0)
        self.gate = threading.Semaphore(0)

    @heard.handler
    def say(self, number: Number) -> None:
        if number.value >= 100:
            self.entered.release()
            self.gate.acquire(timeout=PATIENCE)
        self.said.publish(number)


class Counter(Component):
    """Counts, remembers, and can be told how fast."""

    count = Output(Number)
    rate = Parameter(50.0, "counts per second", minimum=0.0, maximum=2000.0, unit="Hz")
    step = Parameter(1, minimum=1, maximum=10)
    label = Parameter("plain", choices=("plain", "fancy"))
    serial = Parameter("none", read_only=True)

    pace = Quality("of the counts", unit="Hz", better="higher", measured=False)
    counted = Quality("the count", minimum=0.0, estimated=False, name="value")

    state_version = 1

    def __init__(self) -> None:
        self.value = 0
        self.hooks: list[str] = []

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        return {"pace": parameters["rate"] * parameters["step"] * context.get("slope", 1.0)}

    def evaluate(self) -> dict[str, float]:
        return {"value": float(self.value)}

    def on_configure(self) -> None:
        self.hooks.append("configure")

    def on_activate(self) -> None:
        self.hooks.append("activate")

    def on_deactivate(self) -> None:
        self.hooks.append("deactivate")

    def on_cleanup(self) -> None:
        self.hooks.append("cleanup")

    def on_shutdown(self) -> None:
        self.hooks.append("shutdown")

    def on_parameters(self, changed: frozenset[str]) -> None:
        if "step" in changed and self.step == 7:
            raise ValueError("seven is never right")
        self.hooks.append(f"parameters {sorted(changed)}")

    @every(hz=rate)
    def tick(self) -> None:
        self.value += self.step
        self.count.publish(Number(self.value))

    def snapshot(self) -> dict[str, int]:
        return {"value": self.value}

    def restore(self, state: dict[str, int]) -> None:
        self.value = state["value"]


class Oracle(Component):
    """Answers."""

    @service("double")
    def double(self, number: Number) -> Number:
        return Number(2 * number.value)

    def __init__(self) -> None:
        self.waiting = False
        self.go_on = False

    @service("wait")
    async def wait(self, number: Number) -> Number:
        self.waiting = True
        while not self.go_on:
            await self.kit.sleep(0.01)
        return number

    @service("slow")
    async def slow(self, number: Number) -> Number:
        await self.kit.sleep(number.value / 1000)
        return number

    @service("refuse")
    def refuse(self, number: Number) -> Number:
        raise RequestRefused("not today")

    @service("break")
    def break_down(self, number: Number) -> Number:
        raise ZeroDivisionError("by design")

    @service("wrong")
    def wrong(self, number: Number) -> Number:
        return Other("oops")  # type: ignore[return-value]

    @service("heavy")
    async def heavy(self, number: Number) -> Number:
        return Number(await self.kit.compute(_work, number.value))


def _work(value: int) -> int:
    time.sleep(0.02)
    return value + 1


class Walker(Component):
    """Walks to a number, one step at a time."""

    def __init__(self) -> None:
        self.ended: list[str] = []

    @action("walk", feedback=Number)
    async def walk(self, goal: Number) -> Number:
        try:
            for done in range(goal.value):
                self.kit.feedback(Number(done))
                await self.kit.sleep(0.01)
            self.ended.append("arrived")
            return Number(goal.value)
        except Cancelled:
            self.ended.append("cancelled")
            raise


class Asker(Component):
    """Asks the oracle, and tells what it said."""

    answers = Output(Number)
    question = Input(Number)

    @question.handler
    async def ask(self, number: Number) -> None:
        answer = await self.kit.call("double", number, Number, timeout=PATIENCE)
        self.answers.publish(answer)


class Fragile(Component):
    """Breaks wherever it is told to."""

    where = Parameter("nowhere")
    heard = Input(Number, required=False)
    said = Output(Number)

    def on_configure(self) -> None:
        self._break("configure")

    def on_activate(self) -> None:
        self._break("activate")

    def on_error(self) -> None:
        if self.where.endswith("for good"):
            raise RuntimeError("beyond repair")

    @heard.handler
    def hear(self, number: Number) -> None:
        if number.value == 13:
            raise ValueError("unlucky")
        self.said.publish(number)

    def _break(self, here: str) -> None:
        if self.where.startswith(here):
            raise RuntimeError(f"broken in {here}")


class Latest(Component):
    """Looks at the newest message only, when it is time."""

    heard = Input(Number, latest_only=True, required=False)
    said = Output(Number)

    @every(hz=20)
    def look(self) -> None:
        newest = self.heard.latest
        if newest is not None:
            self.said.publish(newest)


class Follower(Component):
    """Has somebody walk for it, all the time."""

    def __init__(self) -> None:
        self.sent = False

    @every(seconds=0.05)
    async def send(self) -> None:
        if not self.sent:
            self.sent = True
            goal = self.kit.goal("walk", Number(10_000), Number, Number)
            await goal.outcome()
