"""What one hears of a relay at a thousand messages a second, while it is exchanged or moved."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise

import zenoh

from benchmarks.harness import Result, percentile
from benchmarks.sides.counting import Number
from benchmarks.sides.links import wait_until
from benchmarks.sides.system import SYSTEM
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys

RATE = 1000.0
TAIL = 0.95
BEFORE, AFTER = 30, 60
"""Messages that are heard before and after each time."""
TOPICS = "  numbers: {type: benchmark/Number}\n  passed: {type: benchmark/Number}"
COMPONENTS = f"""
  talker: {{class: benchmarks.sides.counting:Talker, parameters: {{rate: {RATE}}}}}
  relay: {{class: benchmarks.sides.counting:Relay, connect: {{heard: numbers}}}}
"""


@dataclass(slots=True)
class Ear:
    """Hears numbers, and when they came (s)."""

    numbers: list[int] = field(default_factory=list)
    times: list[float] = field(default_factory=list)

    def take(self, number: int) -> None:
        """Hear one."""
        self.times.append(time.perf_counter())
        self.numbers.append(number)

    def wait_for(self, more: int) -> None:
        """Wait until so many more have been heard."""
        wanted = len(self.times) + more
        wait_until(lambda: len(self.times) >= wanted, f"{more} more messages")

    def around(self, once: Callable[[], object]) -> tuple[float, float]:
        """Hand over once; returns how long it took and the worst pause until well after it, in ms."""
        self.wait_for(BEFORE)
        first, begun = len(self.times) - 1, time.perf_counter()
        once()
        took = time.perf_counter() - begun
        self.wait_for(AFTER)
        return took * 1e3, max(b - a for a, b in pairwise(self.times[first:])) * 1e3

    @property
    def lost(self) -> int:
        """How many never came."""
        return max(self.numbers) - min(self.numbers) + 1 - len(set(self.numbers))

    @property
    def doubled(self) -> int:
        """How many came again."""
        return len(self.numbers) - len(set(self.numbers))


@dataclass(frozen=True, slots=True)
class Handed:
    """What one side gave: how long each time took, the worst pause around each (ms), what was lost and doubled."""

    took: list[float]
    gaps: list[float]
    lost: int
    doubled: int

    @classmethod
    def of(cls, both: list[tuple[float, float]], ear: Ear) -> Handed:
        """Take what ``Ear.around`` has returned each time."""
        return cls([took for took, _ in both], [gap for _, gap in both], ear.lost, ear.doubled)


@contextmanager
def heard(session: zenoh.Session, topic: str) -> Iterator[Ear]:
    """Hear the numbers of a topic."""
    ear = Ear()

    def hear(sample: zenoh.Sample) -> None:
        payload = sample.payload.to_bytes()
        if payload:  # a marker is empty
            ear.take(codec.decode(payload, Number).value)

    subscriber = session.declare_subscriber(Keys(SYSTEM).topic(topic), hear)
    yield ear
    subscriber.undeclare()  # type: ignore[no-untyped-call]


def results(name: str, side: Handed, took: float | None, gap: float | None, faults: int | None) -> tuple[Result, ...]:
    """Return the rows of the table, with the limits on the 95th percentiles (ms) and on what is lost and doubled."""
    note = f"{len(side.took)} at {RATE:g} Hz"
    spread = (min(side.took), max(side.took))
    return (
        Result(f"{name}, p95", percentile(side.took, TAIL), "ms", spread=spread, limit=took, note=note),
        Result(
            f"{name}: worst output gap, p95",
            percentile(side.gaps, TAIL),
            "ms",
            spread=(min(side.gaps), max(side.gaps)),
            limit=gap,
            note=note,
        ),
        Result(f"{name}: lost", side.lost, "messages", limit=faults, note=note),
        Result(f"{name}: doubled", side.doubled, "messages", limit=faults, note=note),
    )
