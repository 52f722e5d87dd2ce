"""Components that count aloud and remember what they heard: for rewiring, parameters, kills, starting many."""

from __future__ import annotations

from dataclasses import dataclass

from regraft import Component, Input, Output, Parameter, every, service
from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.registry import message


@message("benchmark/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """A number, each one greater than the one before."""

    value: Count


@message("benchmark/Ask")
@dataclass(frozen=True, slots=True)
class Ask:
    """Asks for whatever there is to say."""


@message("benchmark/Heard")
@dataclass(frozen=True, slots=True)
class Heard:
    """What was heard since the last question, in order: who said it, and which number."""

    sources: tuple[str, ...]
    numbers: tuple[Count, ...]


class Talker(Component):
    """Counts aloud, all the time."""

    numbers = Output(Number)
    rate = Parameter(1000.0, minimum=0.0, maximum=5000.0, unit="Hz")
    gain = Parameter(0.5, minimum=0.0, maximum=1.0)

    def __init__(self) -> None:
        self.said = 0

    @every(hz=rate)
    def talk(self) -> None:
        """Say the next number."""
        self.said += 1
        self.numbers.publish(Number(self.said))


class Speaker(Component):
    """Counts aloud, but only when it is asked to."""

    numbers = Output(Number)

    def __init__(self) -> None:
        self.said = 0

    @service("say")
    def say(self, ask: Ask) -> Number:
        """Say the next number."""
        self.said += 1
        self.numbers.publish(Number(self.said))
        return Number(self.said)


class Listener(Component):
    """Remembers what it hears."""

    heard = Input(Number, required=False)

    def __init__(self) -> None:
        self.log: list[tuple[str, int]] = []

    @heard.handler
    def hear(self, number: Number) -> None:
        """Remember."""
        envelope = self.heard.envelope
        assert envelope is not None
        self.log.append((envelope.source, number.value))

    @service("tell")
    def tell(self, ask: Ask) -> Heard:
        """Tell what was heard, and forget it."""
        log, self.log = self.log, []
        return Heard(tuple(source for source, _ in log), tuple(number for _, number in log))


class Trivial(Component):
    """Does next to nothing."""

    out = Output(Number)

    @every(hz=1)
    def tick(self) -> None:
        """Say that it is there."""
        self.out.publish(Number(1))


class Relay(Component):
    """Passes on what it hears, and counts it."""

    heard = Input(Number)
    passed = Output(Number)

    def __init__(self) -> None:
        self.count = 0

    @heard.handler
    def pass_on(self, number: Number) -> None:
        """Count, and pass on."""
        self.count += 1
        self.passed.publish(number)

    def snapshot(self) -> PlainValue:
        """Return the count."""
        return {"count": self.count}

    def restore(self, state: PlainValue) -> None:
        """Go on counting."""
        self.count = int(state["count"])


class OtherRelay(Relay):
    """Does the same, as another class."""
