"""A successor whose link does not know of the incumbent yet asks again: on another host, that takes milliseconds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from tests.handover.parts import Sink, Source, Totaller
from tests.handover.site import Threads, Wiring


def test_an_incumbent_that_is_not_found_at_once_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    site, unknown = Threads("memory"), [5]
    kind = type(site.bus)
    asked = kind.ask

    def ask(bus: Any, key: str, payload: bytes, timeout: float, done: Callable[[list[Any]], object]) -> None:
        if key.endswith("/handover") and unknown[0] > 0:
            unknown[0] -= 1
            done([])
        else:
            asked(bus, key, payload, timeout, done)

    monkeypatch.setattr(kind, "ask", ask)
    try:
        site.start(Sink, "sink")
        site.start(Totaller, "totaller")
        site.start(Source, "source", parameters={"rate": 500.0})
        site.swap(Totaller, "totaller", Wiring({"items": ("source",)}, {"totals": ("sink",)}))
        site.hears_on(10)
        assert unknown == [0]
        assert site.faults() == (0, 0, 0, 0)
    finally:
        site.close()
