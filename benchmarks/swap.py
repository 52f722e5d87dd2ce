"""A component is swapped at a thousand messages a second; beside it, the same done by hand with raw Zenoh.

By hand there are two ways: *break before make* ends the old process and starts the new one, *make before break* the
other way round. Neither hands over what the old one knows, nor what is on its way.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from multiprocessing.connection import Connection

import zenoh

from benchmarks.counting import Number
from benchmarks.harness import Effort, Result, percentile
from benchmarks.links import UP_WITHIN, wait_until
from benchmarks.processes import Processes
from benchmarks.raw_swap import NUMBER, OUT, SERVING, relays, source
from benchmarks.system import MANAGER, SYSTEM, System
from bus_schema import codec
from bus_schema.adaptation import Swap
from bus_schema.keys import Keys
from regraft.zenoh_config import Endpoints, config

SWAPS, BY_HAND = 60, 20
RATE = 1000.0
SWAP_LIMIT, GAP_LIMIT = 100.0, 20.0
TAIL = 0.95
BEFORE, AFTER = 30, 60
"""Messages that are heard before and after each swap."""
TOPICS = "  numbers: {type: benchmark/Number}\n  passed: {type: benchmark/Number}"
COMPONENTS = f"""
  talker: {{class: benchmarks.counting:Talker, parameters: {{rate: {RATE}}}}}
  relay: {{class: benchmarks.counting:Relay, connect: {{heard: numbers}}}}
"""
CLASSES = ("benchmarks.counting:OtherRelay", "benchmarks.counting:Relay")


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

    @property
    def lost(self) -> int:
        """How many never came."""
        return max(self.numbers) - min(self.numbers) + 1 - len(set(self.numbers))

    @property
    def doubled(self) -> int:
        """How many came again."""
        return len(self.numbers) - len(set(self.numbers))


@dataclass(frozen=True, slots=True)
class Swapped:
    """What one side gave: how long each swap took, the worst pause around each (ms), what was lost and doubled."""

    took: list[float]
    gaps: list[float]
    lost: int
    doubled: int


def swap(effort: Effort) -> list[Result]:
    """Swap through the manager, then by hand in both ways."""
    with System(TOPICS, COMPONENTS + MANAGER) as system, Processes() as processes:
        system.wait_for_components("talker", "relay", "adaptation_manager")
        session = zenoh.open(config(Endpoints(connect=(system.info.endpoint,)), in_step=False))
        try:
            ours = _through_the_manager(system, session, effort.count(SWAPS, least=2))
            by_hand = effort.count(BY_HAND, least=2)
            hand = _Hand(system.info.endpoint, session, processes)
            broken = hand.swaps(by_hand, make_first=False)
            made = hand.swaps(by_hand, make_first=True)
        finally:
            session.close()  # type: ignore[no-untyped-call]
    return [
        *_results("swap", ours, SWAP_LIMIT, GAP_LIMIT, 0),
        *_results("by hand, break before make", broken, None, None, None),
        *_results("by hand, make before break", made, None, None, None),
    ]


def _results(name: str, side: Swapped, took: float | None, gap: float | None, faults: int | None) -> tuple[Result, ...]:
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


def _around(ear: Ear, swap_once: Callable[[], object]) -> tuple[float, float]:
    """Swap once; returns how long it took and the worst pause until well after it, in ms."""
    ear.wait_for(BEFORE)
    first, begun = len(ear.times) - 1, time.perf_counter()
    swap_once()
    took = time.perf_counter() - begun
    ear.wait_for(AFTER)
    return took * 1e3, max(b - a for a, b in pairwise(ear.times[first:])) * 1e3


def _through_the_manager(system: System, session: zenoh.Session, count: int) -> Swapped:
    ear = Ear()

    def hear(sample: zenoh.Sample) -> None:
        payload = sample.payload.to_bytes()
        if payload:  # a marker is empty
            ear.take(codec.decode(payload, Number).value)

    subscriber = session.declare_subscriber(Keys(SYSTEM).topic("passed"), hear)
    system.adapt(Swap("relay", CLASSES[0]))  # the first imports what the others have imported
    both = [
        _around(ear, lambda number=number: system.adapt(Swap("relay", CLASSES[(number + 1) % 2])))  # type: ignore[misc]
        for number in range(count)
    ]
    subscriber.undeclare()  # type: ignore[no-untyped-call]
    return Swapped([took for took, _ in both], [gap for _, gap in both], ear.lost, ear.doubled)


class _Hand:
    """Relays that are started and ended by hand."""

    def __init__(self, endpoint: str, session: zenoh.Session, processes: Processes) -> None:
        self._session = session
        self._number = 0
        self._pipe: Connection
        self._pipe, theirs = multiprocessing.get_context("spawn").Pipe()
        processes.spawn(relays, endpoint, theirs)
        processes.spawn(source, endpoint, RATE)
        self._start()

    def swaps(self, count: int, *, make_first: bool) -> Swapped:
        ear = Ear()
        subscriber = self._session.declare_subscriber(
            OUT, lambda sample: ear.take(NUMBER.unpack(sample.payload.to_bytes())[0])
        )
        both = [_around(ear, self._make_first if make_first else self._break_first) for _ in range(count)]
        subscriber.undeclare()  # type: ignore[no-untyped-call]
        return Swapped([took for took, _ in both], [gap for _, gap in both], ear.lost, ear.doubled)

    def _make_first(self) -> None:
        former = self._number
        self._start()
        self._tell("stop", former)

    def _break_first(self) -> None:
        self._tell("stop", self._number)
        self._start()

    def _start(self) -> None:
        self._number += 1
        self._tell("start", self._number)
        token = f"{SERVING}/{self._number}"
        wait_until(lambda: list(self._session.liveliness().get(token, timeout=1.0)), f"relay {self._number}")

    def _tell(self, verb: str, number: int) -> None:
        self._pipe.send((verb, number))
        if not self._pipe.poll(UP_WITHIN):
            raise TimeoutError(f"relay {number} was not told of: {verb}")
        self._pipe.recv()
