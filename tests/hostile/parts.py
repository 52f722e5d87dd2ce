"""Components that misbehave, and those that have to live beside them."""

from __future__ import annotations

import math
import os
import signal
import threading
import time
from dataclasses import dataclass

from regraft import Component, Input, Output, Parameter, every, service
from regraft.bus_schema.annotations import Count
from regraft.bus_schema.encoding.registry import message


@message("hostile_tests/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """A number, and some ballast."""

    value: float
    ballast: bytes = b""


@message("hostile_tests/Word")
@dataclass(frozen=True, slots=True)
class Word:
    """Another type than Number."""

    text: str
    count: Count = 0


class Source(Component):
    """Tells a number, again and again."""

    numbers = Output(Number)
    step = Parameter(1.0, minimum=0.0, maximum=10.0, unit="m")

    def __init__(self) -> None:
        self.value = 0.0

    @every(hz=50)
    def tell(self) -> None:
        self.value += self.step
        self.numbers.publish(Number(self.value))


class Sink(Component):
    """Hears numbers; tells how many it has heard."""

    numbers = Input(Number)
    delay = Parameter(0.0, "what each number takes to handle", minimum=0.0, maximum=1.0, unit="s")

    def __init__(self) -> None:
        self.heard = 0
        self.ticks = 0

    @numbers.handler
    def hear(self, number: Number) -> None:
        self.heard += 1
        if self.delay:
            time.sleep(self.delay)

    @every(hz=20)
    def tick(self) -> None:
        self.ticks += 1

    @service("heard")
    def tell(self, word: Word) -> Word:
        return Word(word.text, self.heard)

    @service("ticked")
    def tell_ticks(self, word: Word) -> Word:
        return Word(word.text, self.ticks)


class Ledger(Component):
    """Hears numbers; tells how many of the newest one's predecessors it has not heard, or twice."""

    numbers = Input(Number)

    def __init__(self) -> None:
        self.heard: list[float] = []

    @numbers.handler
    def hear(self, number: Number) -> None:
        if not number.ballast:
            self.heard.append(number.value)

    @service("newest")
    def tell_newest(self, word: Word) -> Word:
        return Word(word.text, int(max(self.heard, default=0.0)))

    @service("amiss")
    def tell_amiss(self, word: Word) -> Word:
        heard = set(self.heard)
        first, newest = int(min(heard, default=1.0)), int(max(heard, default=0.0))
        return Word(word.text, newest - first + 1 - len(heard) + len(self.heard) - len(heard))


class Words(Component):
    """Has an input of another type."""

    numbers = Input(Word)


class Deaf(Component):
    """Does not leave when it is told to."""

    def on_activate(self) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)


class Unborn(Component):
    """Cannot be made."""

    def __init__(self) -> None:
        raise RuntimeError("cannot be made")


class Unprepared(Component):
    """Cannot be prepared."""

    @classmethod
    def preload(cls) -> None:
        raise RuntimeError("cannot be prepared")


class Clumsy(Component):
    """Fails at every number."""

    numbers = Input(Number)

    @numbers.handler
    def fail(self, number: Number) -> None:
        raise ValueError("I drop everything")


class Nan(Component):
    """Publishes what is no number."""

    numbers = Output(Number)

    @every(hz=50)
    def tell(self) -> None:
        self.numbers.publish(Number(math.nan))


class Sneaky(Component):
    """Publishes from a thread of its own."""

    numbers = Output(Number)

    def on_activate(self) -> None:
        self.failure = ""
        threading.Thread(target=self._sneak, daemon=True).start()

    def _sneak(self) -> None:
        while not self.failure:
            try:
                self.numbers.publish(Number(1.0))
            except RuntimeError as error:
                self.failure = str(error)
            time.sleep(0.01)

    @service("failure")
    def tell(self, word: Word) -> Word:
        return Word(self.failure)


class Clinging(Component):
    """Does not let go when it is deactivated."""

    def on_deactivate(self) -> None:
        time.sleep(3600)


class Flood(Component):
    """Publishes far more than anybody can handle, though no more than a link carries."""

    numbers = Output(Number)
    size = Parameter(1000, minimum=0, maximum=10_000_000, unit="B")
    seconds = Parameter(3.0, "then it is silent", minimum=0.0, maximum=6000.0, unit="s")

    def on_activate(self) -> None:
        self.until = self.kit.now() + self.seconds

    @every(hz=100)
    def pour(self) -> None:
        if self.kit.now() > self.until:
            return
        number = Number(0.0, bytes(self.size))
        for _ in range(200):
            self.numbers.publish(number)


class Chatty(Component):
    """Prints and logs whatever happens."""

    def on_activate(self) -> None:
        print("up, with a line long enough to fill something " * 20)
        self.kit.log.warning("and logging")

    @every(hz=50)
    def chat(self) -> None:
        print("still here " * 100)
        os.write(2, b"and past Python\n") if os.environ.get("HOSTILE_RAW") else None

    @service("alive")
    def alive(self, word: Word) -> Word:
        print("asked")
        return word


class Hanging(Component):
    """Hangs when it is asked to."""

    @service("hang")
    def hang(self, word: Word) -> Word:
        time.sleep(3600)
        return word
