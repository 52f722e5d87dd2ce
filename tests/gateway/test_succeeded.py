"""A component may be succeeded by another run while a tool asks it."""

from __future__ import annotations

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryHub, MemoryQuery
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import ComponentView, ParameterValues
from regraft.bus_schema.model.lifecycle import State
from regraft.client import Client, NoAnswer

KEYS = Keys("site")


class Succeeded:
    """A run of a component that ends when it is asked; another one is there then, if there ``is_next``."""

    def __init__(self, bus: MemoryBus, *, is_next: bool = True) -> None:
        self.asked: list[int] = []
        self._is_next = is_next
        self._bus = bus
        self._token = bus.announce(KEYS.alive("gauge", 1))
        bus.serve(KEYS.control("gauge", 1, "*"), self._end)

    def _end(self, query: MemoryQuery) -> None:
        self.asked.append(1)
        self._token.close()
        if self._is_next:
            self._bus.announce(KEYS.alive("gauge", 2))
            self._bus.serve(KEYS.control("gauge", 2, "*"), self._answer)
        query.answered.set()  # as one that nobody gets any more

    def _answer(self, query: MemoryQuery) -> None:
        self.asked.append(2)
        query.reply(codec.encode(ComponentView("gauge", 2, State.ACTIVE, 0, {}, {})))


def test_what_is_only_read_is_asked_of_the_run_that_succeeds_the_one_asked() -> None:
    hub = MemoryHub()
    with Client(MemoryBus(hub), "site") as client:
        succeeded = Succeeded(MemoryBus(hub))
        assert client.view("gauge").incarnation == 2
        assert succeeded.asked == [1, 2]


def test_what_changes_something_is_asked_of_one_run_alone() -> None:
    hub = MemoryHub()
    with Client(MemoryBus(hub), "site") as client:
        succeeded = Succeeded(MemoryBus(hub))
        with pytest.raises(NoAnswer):
            client.control("gauge", "parameters", ParameterValues({"rate": 1.0}))
        assert succeeded.asked == [1]


def test_a_component_that_ends_as_it_is_asked_has_not_answered() -> None:
    hub = MemoryHub()
    with Client(MemoryBus(hub), "site") as client:
        Succeeded(MemoryBus(hub), is_next=False)
        with pytest.raises(NoAnswer):
            client.view("gauge")
