"""A handler of a `latest_only` input that is slower than what comes in acts on what is new, under the real clock."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest

from regraft import Component, Input, Output, every
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.testing import Rig
from tests.kit.parts import Number
from tests.stepped.parts import TinyWorld
from tests.support.stepped.step_site import StepSite

MANY = 100


class Source(Component):
    """Publishes when a test wants it."""

    seen = Output(Number)
    other = Output(Number)

    def publish(self, first: int, last: int) -> None:
        for value in range(first, last + 1):
            self.seen.publish(Number(value))


class Watcher(Component):
    """Looks at the newest message; ``meanwhile`` is what happens while it does so."""

    seen = Input(Number, latest_only=True)
    other = Input(Number)

    def __init__(self) -> None:
        self.handled: list[int] = []
        self.awaited: list[int] = []
        self.read: Number | None = None
        self.fails = False
        self.meanwhile: Callable[[], object] = lambda: None

    @seen.handler
    def see(self, number: Number) -> None:
        assert self.seen.latest == number
        assert self.seen.envelope is not None
        self.handled.append(number.value)
        meanwhile, self.meanwhile = self.meanwhile, lambda: None
        meanwhile()

    @other.handler
    def look(self, _: Number) -> None:
        self.read = self.seen.latest
        if self.fails:
            self.kit.fail("enough")

    @every(seconds=1.0)
    async def wait(self) -> None:
        self.awaited.append((await self.seen.next()).value)


class Thinker(Watcher):
    """Handles messages as a task."""

    seen = Input(Number, latest_only=True)

    @seen.handler
    async def think(self, number: Number) -> None:
        self.see(number)


class Burst(Component):
    """Publishes many messages at once."""

    seen = Output(Number)

    def __init__(self) -> None:
        self.done = False

    @every(seconds=1.0)
    def burst(self) -> None:
        if not self.done:
            self.done = True
            for value in range(MANY):
                self.seen.publish(Number(value))


@pytest.mark.parametrize("cls", [Watcher, Thinker])
def test_a_slow_handler_gets_the_newest_of_what_came_meanwhile(cls: type[Watcher]) -> None:
    with Rig() as rig:
        source, watcher = rig.add(Source), rig.add(cls, "watcher")
        watcher.meanwhile = partial(source.publish, 2, MANY)
        source.publish(1, 1)
        rig.settle()
        assert watcher.handled == [1, MANY]
        assert rig.status("watcher").lost == 0
        source.publish(MANY + 1, MANY + 1)
        rig.settle()
        assert watcher.handled == [1, MANY, MANY + 1]


def test_the_newest_is_handled_also_if_it_was_looked_at_before() -> None:
    with Rig() as rig:
        source, watcher = rig.add(Source), rig.add(Watcher)
        source.publish(1, 1)
        source.other.publish(Number(0))
        rig.settle()
        assert watcher.read == Number(1)
        assert watcher.handled == [1]


def test_who_awaits_the_next_message_gets_it_and_the_handler_the_newest() -> None:
    with Rig() as rig:
        source, watcher = rig.add(Source), rig.add(Watcher)
        rig.advance(1.0)
        source.publish(1, MANY)
        rig.settle()
        assert watcher.awaited == [1]
        assert watcher.handled == [MANY]


@pytest.mark.parametrize("cls", [Watcher, Thinker])
def test_what_came_before_a_control_query_is_handled_before_it(cls: type[Watcher]) -> None:
    with Rig() as rig:
        source, watcher = rig.add(Source), rig.add(cls, "watcher")
        source.publish(1, 2)
        asked = codec.encode(SetTransition(Transition.DEACTIVATE))
        rig.bus.ask(rig.keys.control("watcher", 1, "transition"), asked, 5.0, lambda answers: None)
        source.publish(3, 4)
        rig.settle()
        assert rig.status("watcher").state is State.INACTIVE
        assert watcher.handled == [2]


def test_what_is_in_line_as_a_component_fails_is_not_handled_afterwards() -> None:
    with Rig() as rig:
        source, watcher = rig.add(Source), rig.add(Watcher)
        watcher.fails = True
        source.publish(1, 2)
        source.other.publish(Number(0))
        rig.settle()
        assert watcher.handled == []
        for transition in (Transition.CONFIGURE, Transition.ACTIVATE):
            rig.transition("watcher", transition)
        source.publish(MANY + 1, MANY + 1)
        rig.settle()
        assert watcher.handled == [MANY + 1]


class Both(Component):
    """Reads a topic twice: the newest message, and every one."""

    newest = Input(Number, topic="numbers", latest_only=True)
    every_one = Input(Number, topic="numbers")


def test_a_loss_counts_also_where_another_input_of_the_topic_reads_the_newest() -> None:
    with Rig() as rig:
        rig.add(Both)
        rig.runtimes["both"].repair.rest()  # nobody is asked for what is missing
        put = rig.bus.publisher(rig.keys.topic("numbers"), type_of(Number).encoding, reliable=True).put
        for sequence in (1, 2, 9):
            put(codec.encode(Number(sequence)), Envelope("ghost", 1, 1, sequence, 0).to_bytes())
        rig.advance_until(lambda: rig.status("both").lost > 0)
        assert rig.status("both").lost == 6
        assert [event.text for event in rig.events if event.kind == "message.lost"] == [
            "input 'every_one': 6 from ghost"
        ]


def test_in_simulated_time_the_handler_gets_every_message() -> None:
    steps = StepSite("memory")
    try:
        steps.start(Burst, "burst")
        steps.start(Watcher, "watcher")
        steps.start_world(TinyWorld, ("burst", "watcher"), 2.5)
        assert steps.wait_finished().reproducible
        watcher: Watcher = steps.component("watcher")
        assert watcher.handled == list(range(MANY))
    finally:
        steps.close()
