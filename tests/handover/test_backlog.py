"""A successor handles what had no room in the handler of its incumbent."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft import Component, Input, Parameter
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.messages.protocol.handover import HandoverStep
from regraft.bus_schema.model.lifecycle import Transition
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writers
from tests.handover.parts import Item
from tests.handover.site import Threads
from tests.support.waiting import PATIENCE, wait_until

MANY = 60
begun: list[tuple[int, int]] = []


class Pondering(Component):
    """Begins with each item at once, and is never done with it in its first run."""

    items = Input(Item)
    run = Parameter(1, "which run of the component this is")

    @items.handler
    async def take(self, item: Item) -> None:
        run = self.run
        begun.append((run, item.number))
        await self.kit.sleep(3600.0 if run == 1 else 0.001)


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> Iterator[Threads]:
    """Return a site where handlers have little room."""
    monkeypatch.setattr("regraft.runtime.core.overlap.MAX_OVERLAPPING", 10)
    begun.clear()
    made = Threads("memory")
    yield made
    made.close()


def test_a_successor_handles_what_had_no_room_before_it(site: Threads) -> None:
    site.start(Pondering, "pondering")
    site.control("pondering", 1, "transition", SetTransition(Transition.DEACTIVATE, hold=True))
    writers = Writers(site.session(), RealClock(), Identity("source", 1, 1))
    writer = writers.open(site.keys.topic("items"), type_of(Item).encoding)
    assert writer.wait_for_reader(PATIENCE)
    writer.mark()
    for number in range(MANY):
        writer.put(codec.encode(Item(number)))
    site.control("pondering", 1, "transition", SetTransition(Transition.ACTIVATE))
    wait_until(lambda: len(begun) == 10, "the handler to be full")
    successor = site.spawn(Pondering, "pondering", parameters={"run": 2})
    site.step("pondering", successor, HandoverStep.TAKE_OVER)
    wait_until(lambda: len(begun) == MANY, "all to be begun")
    assert begun == [(1 if number < 10 else 2, number) for number in range(MANY)]
