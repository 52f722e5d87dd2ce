"""Missing messages are asked for until it is sure that they cannot come: a writer that is busy is not gone."""

from __future__ import annotations

import queue
from collections.abc import Callable

import pytest

from regraft.bus.interface import Sample
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Resend
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.data import repair as repairing
from regraft.runtime.data.repair import Repair
from regraft.runtime.data.stream import Stream
from regraft.runtime.data.writers import Identity, Writers
from tests.support.waiting import PATIENCE

KEYS = Keys("s")
TOPIC = KEYS.topic("numbers")
PAIR = (TOPIC, "writer")


class Reader:
    """A repair that asks a writer again, with its thread in the hands of the test."""

    def __init__(self, hub: MemoryHub) -> None:
        self.posted: queue.Queue[Callable[[], object]] = queue.Queue()
        self.arrived: list[Sample] = []
        self.repair = Repair(MemoryBus(hub), KEYS, "reader", self.posted.put)
        self.repair.arrive = self.arrived.append

    def ask(self, stream: Stream) -> bool:
        """Ask for the first message, and take what comes of it; return whether it may still come."""
        self.repair.may_come(PAIR, stream, 1, 1)
        self.posted.get(timeout=PATIENCE)()
        return self.repair.may_come(PAIR, stream, 1, 1)


@pytest.fixture
def hub(monkeypatch: pytest.MonkeyPatch) -> MemoryHub:
    monkeypatch.setattr(repairing, "NO_WRITER_TIMEOUT", 0.0)
    monkeypatch.setattr(repairing, "ANSWER_TIMEOUT", 0.02)
    return MemoryHub()


def test_a_writer_that_does_not_answer_is_waited_for(hub: MemoryHub) -> None:
    MemoryBus(hub).serve(KEYS.control("writer", 1, "*"), lambda _: None)
    assert Reader(hub).ask(Stream(epoch=1, incarnation=1))


def test_a_writer_that_is_not_there_is_given_up(hub: MemoryHub) -> None:
    assert not Reader(hub).ask(Stream(epoch=1, incarnation=1))


def test_the_first_message_of_a_writer_that_nothing_has_come_of_is_sent_again(hub: MemoryHub) -> None:
    bus = MemoryBus(hub)
    writers = Writers(bus, SteppedClock(), Identity("writer", 3, 3))
    writers.keeps_history = True
    writers.open(TOPIC, "application/octet-stream").put(b"first")

    def answer(query: object) -> None:
        opened = bus.open_query(query)
        assert opened is not None
        opened.reply(codec.encode(writers.resend(codec.decode(opened.payload, Resend))))

    bus.serve(KEYS.control("writer", 3, "*"), answer)
    reader = Reader(hub)
    reader.ask(Stream())
    assert [sample.payload for sample in reader.arrived] == [b"first"]
