"""A successor begins the goals of all clients again in the order in which they were given."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from regraft import Component, action
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writers
from tests.handover.parts import Ask, Item
from tests.handover.site import Threads, Wiring
from tests.support.waiting import PATIENCE, wait_until


class Waiter(Component):
    """Serves tables until it is cancelled."""

    def __init__(self) -> None:
        self.begun: list[int] = []

    @action("serve", feedback=Item, goals=3)
    async def serve(self, table: Ask) -> Item:
        """Serve a table, for as long as it takes."""
        return await self._serve(table)

    async def _serve(self, table: Ask) -> Item:
        self.begun.append(table.number)
        await self.kit.sleep(1e6)
        return Item(table.number)

    def snapshot(self) -> PlainValue:
        return None

    def restore(self, state: PlainValue) -> None:
        pass


class Slower(Waiter):
    """Serves fewer tables at once."""

    @action("serve", feedback=Item, goals=2)
    async def serve(self, table: Ask) -> Item:
        return await self._serve(table)


class Slowest(Waiter):
    """Serves one table at a time."""

    @action("serve", feedback=Item)
    async def serve(self, table: Ask) -> Item:
        return await self._serve(table)


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """A bus of either kind, with a waiter."""
    made = Threads(request.param)
    made.start(Waiter, "waiter")
    yield made
    made.close()


class Guest:
    """Asks without the kit's help, so that a test has it ask when it wants."""

    def __init__(self, site: Threads, name: str) -> None:
        self._name = name
        self._replies: list[Reply] = []
        self._bus = site.session()
        self._bus.subscribe(site.keys.reply("serve", name), self._take)
        writers = Writers(self._bus, RealClock(), Identity(name, 1, 1))
        self._requests = writers.open(site.keys.request("serve"), type_of(Request).encoding)
        assert self._requests.wait_for_reader(PATIENCE)

    def _take(self, item: Any) -> None:
        sample = self._bus.open_sample(item)
        if sample is not None and sample.payload:
            self._replies.append(codec.decode(sample.payload, Reply))

    def order(self, number: int, table: int) -> None:
        """Give a goal, and wait until it is pursued."""
        self._ask(Request(self._name, number, Verb.GOAL, codec.to_plain(Ask(table))))

    def ask_again(self, number: int) -> None:
        """Ask for a result that is not there yet, as after silence."""
        self._ask(Request(self._name, number, Verb.RESULT))

    def _ask(self, request: Request) -> None:
        before = len(self._replies)
        self._requests.put(codec.encode(request))
        wait_until(lambda: len(self._replies) > before, "a reply")
        assert self._replies[-1].answer is Answer.ACCEPTED


@pytest.mark.parametrize(("successor", "kept"), [(Waiter, [1, 2, 3]), (Slower, [2, 3]), (Slowest, [3])])
def test_a_successor_begins_the_newest_goals_again_whoever_asked_last(
    site: Threads, successor: type[Component], kept: list[int]
) -> None:
    first, second = Guest(site, "first"), Guest(site, "second")
    first.order(1, table=1)
    second.order(1, table=2)
    first.order(2, table=3)
    second.ask_again(1)
    site.swap(successor, "waiter", Wiring())
    waiter = site.component("waiter")
    wait_until(lambda: waiter.begun == kept, f"{kept} to be served")


def test_a_newer_goal_continues_where_the_client_of_the_older_one_asked_last(site: Threads) -> None:
    first, second = Guest(site, "first"), Guest(site, "second")
    first.order(1, table=1)
    second.order(1, table=2)
    first.ask_again(1)
    site.swap(Slowest, "waiter", Wiring())
    waiter = site.component("waiter")
    wait_until(lambda: waiter.begun, "a table to be served")
    assert waiter.begun == [2]
