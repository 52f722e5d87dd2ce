"""A component that runs for weeks keeps nothing of those who have gone."""

from __future__ import annotations

import gc
import weakref

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.client import TopicSample
from regraft.runtime.core.clock import RealClock
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
