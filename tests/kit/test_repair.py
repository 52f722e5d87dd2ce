"""Messages that a link has lost are sent again: a reader misses nothing that a living writer has put."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import pytest

import regraft.runtime.data.repair as repair_module
import regraft.runtime.runtime as runtime_module
from regraft import Component, Input, Output, every
from regraft.bus.memory_bus import MemoryBus, MemoryHub, MemoryQuery
from regraft.bus.zenoh_bus import ZenohBus, ZenohPublisher, open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.annotations import Count
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Resent
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import class_path
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.data.repair import Repair
from regraft.runtime.data.sent_history import MAX_BYTES, MAX_KEPT, History
from regraft.runtime.data.stream import Stream
from tests.kit.test_broken_links import cable, hub
from tests.support.links import Cable
from tests.support.machine.threads import ComponentThread
from tests.support.waiting import PATIENCE, wait_until

__all__ = ["cable", "hub"]

SYSTEM = "repair"
CUTS = 10


@message("repair_tests/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """A number, with some weight."""

    number: Count
    weight: bytes = b""


class Counter(Component):
    """Counts at 1 kHz."""

    numbers = Output(Number)

    def on_configure(self) -> None:
        self.number = 0
        self.quiet = False

    @every(hz=1000)
    def count(self) -> None:
        if not self.quiet:
            self.number += 1
            self.numbers.publish(Number(self.number, b"x" * 100))


class Keeper(Component):
    """Keeps all numbers that it hears."""

    numbers = Input(Number)

    def on_configure(self) -> None:
        self.heard: list[int] = []

    @numbers.handler
    def hear(self, number: Number) -> None:
        self.heard.append(number.number)


def run(cls: type[Component], port: int) -> ComponentThread:
    """Run a component on a session of its own, and wait until it is active."""
    bus = open_bus(Endpoints(connect=(f"tcp/127.0.0.1:{port}",)))
    running = ComponentThread(cls, Assignment(SYSTEM, cls.__name__.lower(), class_path(cls)), bus, ended=bus.close)
    running.wait_started()
    wait_until(lambda: running.runtime.state is State.ACTIVE, "to be active")
    return running


@pytest.fixture
def listener(hub: tuple[ZenohBus, int], request: pytest.FixtureRequest) -> Iterator[ComponentThread]:
    running = run(Keeper, hub[1])
    yield running
    running.end()


def in_sequence(listener: ComponentThread) -> bool:
    heard = list(listener.component.heard)  # it hears on
    return bool(heard == list(range(heard[0], heard[-1] + 1)))


def hears_on(listener: ComponentThread, more: int = 50) -> None:
    heard = listener.component.heard
    goal = len(heard) + more
    wait_until(lambda: len(heard) >= goal, "to be heard")


def test_a_writers_link_that_breaks_again_and_again_loses_nothing(
    hub: tuple[ZenohBus, int], cable: Cable, listener: ComponentThread
) -> None:
    counter = run(Counter, cable.port)
    try:
        for _ in range(CUTS):
            hears_on(listener)
            cable.cut()
        hears_on(listener)
        assert in_sequence(listener)
        assert listener.runtime.reporter.status.lost == 0
    finally:
        counter.end()


def test_a_readers_link_that_breaks_again_and_again_loses_nothing(hub: tuple[ZenohBus, int], cable: Cable) -> None:
    counter, listener = run(Counter, hub[1]), run(Keeper, cable.port)
    try:
        for _ in range(CUTS):
            hears_on(listener)
            cable.cut()
        hears_on(listener)
        assert in_sequence(listener)
        assert listener.runtime.reporter.status.lost == 0
    finally:
        counter.end()
        listener.end()


@pytest.mark.parametrize("cut", ["writer", "reader"])
def test_the_last_messages_come_although_none_follows_them(hub: tuple[ZenohBus, int], cable: Cable, cut: str) -> None:
    ports = {"writer": hub[1], "reader": hub[1], cut: cable.port}
    listener, counter = run(Keeper, ports["reader"]), run(Counter, ports["writer"])
    try:
        hears_on(listener)
        component = counter.runtime.component
        assert isinstance(component, Counter)
        cable.plugged = False
        cable.cut()
        last = component.number
        wait_until(lambda: component.number >= last + 20, "to count without a link")
        component.quiet = True
        cable.plugged = True
        heard = listener.component.heard
        wait_until(lambda: heard[-1] == component.number, "the last number")
        assert in_sequence(listener)
    finally:
        counter.end()
        listener.end()


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Return what, while it is cleared, has sessions know no reader: what is put reaches nobody."""
    readers_known, put, matched = threading.Event(), ZenohPublisher.put, ZenohPublisher.matched
    readers_known.set()

    def put_if_known(publisher: ZenohPublisher, payload: bytes, attachment: bytes) -> None:
        if readers_known.is_set():
            put(publisher, payload, attachment)

    def matched_if_known(publisher: ZenohPublisher) -> bool:
        return readers_known.is_set() and bool(matched.__get__(publisher))

    monkeypatch.setattr(ZenohPublisher, "put", put_if_known)
    monkeypatch.setattr(ZenohPublisher, "matched", property(matched_if_known))
    return readers_known


@pytest.mark.parametrize("deactivated", [False, True], ids=["active", "deactivated"])
def test_readers_that_a_new_link_knows_late_miss_nothing(
    hub: tuple[ZenohBus, int],
    cable: Cable,
    listener: ComponentThread,
    known: threading.Event,
    monkeypatch: pytest.MonkeyPatch,
    deactivated: bool,
) -> None:
    monkeypatch.setattr(runtime_module, "MARK_PAUSES", ())
    counter = run(Counter, cable.port)
    try:
        hears_on(listener)
        component, renewed = counter.runtime.component, threading.Event()
        assert isinstance(component, Counter)
        known.clear()
        last = component.number
        wait_until(lambda: component.number >= last + 20, "to count for nobody")
        component.quiet = True
        counter.runtime.bus.when_renewed(renewed.set)
        cable.cut()
        assert renewed.wait(PATIENCE)
        marked = threading.Event()
        counter.runtime.post(marked.set)  # behind the first marker
        assert marked.wait(PATIENCE)
        if deactivated:
            counter.runtime.post(lambda: counter.runtime.lifecycle.perform(Transition.DEACTIVATE))
            wait_until(lambda: counter.runtime.state is State.INACTIVE, "to be inactive")
        known.set()
        wait_until(lambda: listener.component.heard[-1] == component.number, "the last number")
        assert in_sequence(listener)
    finally:
        counter.end()


def test_what_a_writer_does_not_have_any_more_counts_as_lost_and_the_rest_goes_on(
    hub: tuple[ZenohBus, int], listener: ComponentThread
) -> None:
    counter = run(Counter, hub[1])
    try:
        hears_on(listener)
        component = counter.runtime.component
        assert isinstance(component, Counter)

        def skip() -> None:
            counter.runtime.writers.open_keys[Keys(SYSTEM).topic("numbers")].sequence += 5

        counter.runtime.post(skip)
        wait_until(lambda: listener.runtime.reporter.status.lost == 5, "the loss")
        hears_on(listener)
    finally:
        counter.end()


def test_a_source_that_is_no_component_costs_no_more_than_before(
    hub: tuple[ZenohBus, int], listener: ComponentThread
) -> None:
    key = Keys(SYSTEM).topic("numbers")
    publisher = hub[0].publisher(key, "application/msgpack;repair_tests/Number@1", reliable=True)
    wait_until(lambda: publisher.matched, "the reader")
    for sequence in (1, 2, 9, 10):
        publisher.put(
            b"\x82\xa6number" + bytes([sequence]) + b"\xa6weight\xc4\x00",
            Envelope("ghost", 1, 1, sequence, 0).to_bytes(),
        )
    heard = listener.component.heard
    wait_until(lambda: heard == [1, 2, 9, 10], "the rest")
    assert listener.runtime.reporter.status.lost == 6


def test_a_history_is_bounded_and_gives_what_it_has() -> None:
    history = History()
    attachments = [Envelope("a", 3, 3, n, 0).to_bytes() for n in range(1, MAX_KEPT + 11)]
    for n, attachment in enumerate(attachments, 1):
        history.keep((3, n), b"x", attachment)
    kept = [Envelope.from_bytes(sent[1]).sequence for sent in history.find(3, 1, MAX_KEPT + 10)]
    assert kept == list(range(11, MAX_KEPT + 11))
    assert history.find(2, 1, MAX_KEPT) == []
    assert len(history.find(3, 20, 24)) == 5
    for n, attachment in enumerate(attachments[:3], 1):
        history.keep((3, n), bytes(MAX_BYTES), attachment)
    assert len(history.find(3, 1, 3)) == 1, "one answer is bounded, but holds one sample"
    assert Envelope.from_bytes(history.find(3, 1, 3)[0][1]).sequence == 2, "the last two are kept, however large"


def _catch_up() -> tuple[list[str], list[Callable[[], object]]]:
    """Ask two writers, of which one has gone, for what a link has lost; returns who is asked, and what is answered."""
    hub = MemoryHub()
    asking, answering = MemoryBus(hub), MemoryBus(hub)
    posted: list[Callable[[], object]] = []
    asked_of: list[str] = []
    for name in ("gone", "living"):
        answering.serve(Keys(SYSTEM).control(name, 1, "resend"), partial(_answer, asked_of, name))
    key = Keys(SYSTEM).topic("numbers")
    repair = Repair(asking, Keys(SYSTEM), "keeper", posted.append)
    repair.catch_up({(key, name): Stream(incarnation=1, handled=0) for name in ("gone", "living")})
    return asked_of, posted


def test_writers_that_have_gone_keep_nobody_waiting_for_what_others_have_put() -> None:
    asked_of, posted = _catch_up()
    wait_until(lambda: asked_of.count("gone") > 1, "the next question")
    assert asked_of[:3] == ["gone", "living", "gone"]
    assert len(posted) == 1


def test_writers_that_have_gone_are_not_asked_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    wait_until(lambda: not _is_catching_up(), "earlier questions")
    monkeypatch.setattr(repair_module, "CATCH_UP_TIMEOUT", 0.1)
    asked_of, _ = _catch_up()
    wait_until(lambda: not _is_catching_up(), "the last question")
    assert asked_of[:2] == ["gone", "living"]


def _is_catching_up() -> bool:
    return "catch-up" in {thread.name for thread in threading.enumerate()}


def _answer(asked_of: list[str], name: str, query: MemoryQuery) -> None:
    asked_of.append(name)
    if name == "living":
        query.reply(codec.encode(Resent()))
    else:
        query.answered.set()  # as one that nobody gets
