"""A client waits for the reader of a new key once, for all its requests together, and numbers what it puts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import pytest

from regraft.bus.interface import Sample
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.client import sending
from regraft.client.sending import Sender
from tests.support.waiting import PATIENCE

KEY = "regraft/site/request/nothing"


@dataclass
class Watched:
    """A publisher that reports each look at whether somebody subscribes."""

    inner: Any
    look: Callable[[], object]

    @property
    def matched(self) -> bool:
        """Whether somebody subscribes."""
        self.look()
        return bool(self.inner.matched)

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Put."""
        self.inner.put(payload, attachment)

    def close(self) -> None:
        """Undeclare."""
        self.inner.close()


class WatchedBus(MemoryBus):
    """A bus whose publishers are watched."""

    def __init__(self, hub: MemoryHub, look: Callable[[], object]) -> None:
        super().__init__(hub)
        self.look = look

    def publisher(self, key: str, encoding: str, *, reliable: bool) -> Any:
        """Declare a publisher."""
        return Watched(super().publisher(key, encoding, reliable=reliable), self.look)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a new key wait for its reader as long as a test may take."""
    monkeypatch.setattr(sending, "WAIT_FOR_READER", PATIENCE)


def test_a_key_that_nobody_reads_is_waited_for_once() -> None:
    looks: list[None] = []
    sender = Sender(WatchedBus(MemoryHub(), lambda: looks.append(None)), "tester")
    assert not sender.reaches(KEY, "")
    looks.clear()
    for _ in range(10):
        assert not sender.reaches(KEY, "")
    sender.put_payload(KEY, b"", "")
    assert len(looks) == 10


@pytest.mark.usefixtures("patient")
def test_requests_wait_for_a_reader_at_the_same_time() -> None:
    hub, together, met = MemoryHub(), threading.Barrier(4), list[None]()

    def look() -> None:
        if not met:
            together.wait(PATIENCE)
            met.append(None)

    MemoryBus(hub).subscribe(KEY, lambda _: None)
    sender = Sender(WatchedBus(hub, look), "tester")
    threads = [threading.Thread(target=sender.reaches, args=(KEY, "")) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(2 * PATIENCE)
    assert len(met) == 4


@pytest.mark.usefixtures("patient")
def test_what_many_put_at_a_new_key_is_numbered_in_the_order_of_its_puts() -> None:
    hub, looked, numbers = MemoryHub(), threading.Event(), list[int]()
    sender = Sender(WatchedBus(hub, looked.set), "tester")

    def take(item: object) -> None:
        numbers.append(Envelope.from_bytes(cast("Sample", item).attachment).sequence)

    def put() -> None:
        for _ in range(50):
            sender.put_payload(KEY, b"", "")

    threads = [threading.Thread(target=put) for _ in range(8)]
    for thread in threads:
        thread.start()
    assert looked.wait(PATIENCE)
    MemoryBus(hub).subscribe(KEY, take)
    for thread in threads:
        thread.join(PATIENCE)
    assert numbers == list(range(1, 401))
