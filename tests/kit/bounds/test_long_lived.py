"""A component that runs for weeks keeps nothing of those who have gone."""

from __future__ import annotations

import gc
import weakref

import pytest

from regraft.bus.interface import Sample
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.client import TopicSample
from regraft.runtime.core.clock import RealClock, SteppedClock
from regraft.runtime.data.inbound import MAX_STREAMS, Inbound
from regraft.runtime.data.writers import MAX_RETIRED, Identity, Writers
from tests.kit.parts import Number
from tests.support.stepped.site import Site


def _writers() -> Writers:
    return Writers(MemoryBus(MemoryHub()), RealClock(), Identity("writer", 1, 1))


def test_the_numbering_for_clients_that_have_gone_is_kept_for_the_last_of_them() -> None:
    writers = _writers()
    for client in range(MAX_RETIRED + 10):
        writers.open(f"reply/{client}", "").put(b"")
        writers.retire(f"reply/{client}")
    assert set(writers.numbering()) == {f"reply/{client}" for client in range(10, MAX_RETIRED + 10)}


def test_a_client_that_comes_back_finds_its_numbering_continued() -> None:
    writers = _writers()
    for _ in range(3):
        writers.open("reply/patient", "").put(b"")
        writers.retire("reply/patient")
        for client in range(MAX_RETIRED - 1):
            writers.retire(f"reply/{client}")
    assert writers.open("reply/patient", "").sequence == 3


def test_the_numbering_of_a_topic_is_kept_however_many_clients_have_gone() -> None:
    writers = _writers()
    writers.open("topic", "").put(b"")
    writers.close("topic")
    for client in range(MAX_RETIRED + 10):
        writers.retire(f"reply/{client}")
    assert writers.open("topic", "").sequence == 1


class Reader:
    """Takes all that comes, and counts what is refused."""

    reliable, paused, wakes = True, False, True

    def __init__(self) -> None:
        self.refused = 0

    def deliver(self, sample: Sample) -> None:
        pass

    def refuse(self, source: str, why: str) -> None:
        self.refused += 1

    def report_lost(self, source: str, count: int) -> None:
        pass


def _sample(source: str, sequence: int, kind: Kind = Kind.DATA, epoch: int = 1) -> Sample:
    return Sample("data", b"", Envelope(source, epoch, epoch, sequence, 0, kind).to_bytes(), "")


def _given_out(inbound: Inbound) -> list[tuple[str, int]]:
    given = [Envelope.from_bytes(sample.attachment) for _, sample in inbound.ready]
    inbound.ready.clear()
    return [(envelope.source, envelope.sequence) for envelope in given]


def test_how_far_a_member_of_simulated_time_has_come_is_known_however_many_others_have_sent() -> None:
    inbound = Inbound(SteppedClock(0), stepped=True)
    inbound.add("data", Reader())
    inbound.arrive(_sample("member", 0, Kind.MARKER))
    for sequence in range(1, 6):
        inbound.arrive(_sample("member", sequence))
    inbound.release({"data": {"member": 5}})
    assert _given_out(inbound) == [("member", sequence) for sequence in range(1, 6)]
    for stranger in range(MAX_STREAMS + 10):
        inbound.arrive(_sample(f"client-{stranger}", 1))
        inbound.release_outside((f"client-{stranger}",))
    assert len(inbound.streams) == MAX_STREAMS
    inbound.ready.clear()
    inbound.arrive(_sample("member", 6))
    assert inbound.holds({"data": {"member": 6}})
    inbound.release({"data": {"member": 6}})
    assert _given_out(inbound) == [("member", 6)]


@pytest.mark.parametrize("marked", [True, False])
def test_how_far_who_still_sends_has_come_is_known_however_many_others_have_gone(marked: bool) -> None:
    reader, inbound = Reader(), Inbound(RealClock(), stepped=False)
    inbound.add("data", reader)
    if marked:
        inbound.arrive(_sample("source", 0, Kind.MARKER, epoch=2))
    for stranger in range(MAX_STREAMS + 10):
        if not marked and stranger % 1000 == 0 and stranger < MAX_STREAMS:
            inbound.arrive(_sample("source", 1 + stranger // 1000, epoch=2))
        inbound.arrive(_sample(f"client-{stranger}", 1))
    assert len(inbound.streams) == MAX_STREAMS
    inbound.ready.clear()
    inbound.arrive(_sample("source", 20, epoch=1))
    assert (reader.refused, _given_out(inbound)) == (1, [])


class Look:
    """Somebody who looks at a topic for a while."""

    def take(self, sample: TopicSample) -> None:
        pass


def test_nothing_is_kept_of_a_look_at_a_topic_that_has_ended(site: Site) -> None:
    look = Look()
    ended = weakref.ref(look)
    site.client.topic("heard", Number, look.take).close()
    del look
    gc.collect()
    assert ended() is None
