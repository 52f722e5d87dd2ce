"""A client's knowledge of what components have measured last."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.client import Client
from regraft.client import listener as listening
from tests.support.waiting import wait_until


class Gauge:
    """Publishes measurements, and a client that hears them."""

    def __init__(self) -> None:
        hub = MemoryHub()
        self.client = Client(MemoryBus(hub), "site", "reader")
        key = Keys("site").qualities("gauge")
        self._publisher = MemoryBus(hub).publisher(key, type_of(MeasuredQualities).encoding, reliable=True)

    def put(self, value: float) -> None:
        """Publish a measurement."""
        self._publisher.put(codec.encode(MeasuredQualities(value, "gauge", 1, 1.0, {"level": value})), b"")

    def level(self) -> float | None:
        """Return what the client knows now."""
        measured = self.client.last_measured("gauge")
        return None if measured is None else measured.values["level"]


@pytest.fixture
def gauge(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gauge]:
    monkeypatch.setattr(listening, "LOOK_AROUND", 3600.0)
    gauge = Gauge()
    yield gauge
    gauge.client.close()


def test_what_was_measured_is_known_at_once_to_who_asks_although_it_wakes_nobody(gauge: Gauge) -> None:
    assert gauge.level() is None
    for value in (1.0, 2.0, 3.0):
        gauge.put(value)
        assert gauge.level() == value
    gauge.put(4.0)
    gauge.put(5.0)
    assert gauge.level() == 5.0


def test_measurements_that_nobody_asks_for_are_taken_when_the_client_looks() -> None:
    gauge = Gauge()
    try:
        gauge.put(1.0)
        wait_until(lambda: gauge.client._board.measured("gauge") is not None, "the client to look")
    finally:
        gauge.client.close()


def test_a_flood_of_measurements_is_bounded(gauge: Gauge, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listening, "MAX_WAITING", 3)
    for value in (1.0, 2.0, 3.0, 4.0):
        gauge.put(value)
    assert gauge.level() == 3.0
    gauge.put(5.0)
    assert gauge.level() == 5.0
