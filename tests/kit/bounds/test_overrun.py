"""Asynchronous handlers that are slower than what comes in: nothing piles up, and it is reported."""

from __future__ import annotations

import pytest

from regraft import CallFailed, Component, Input, Output, Parameter, RefusalCode, every, service
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.bus_schema.model.lifecycle import Transition
from regraft.runtime.core.overlap import MAX_OVERLAPPING
from regraft.runtime.data.writers import Identity, Writers
from regraft.runtime.requests import request_server
from regraft.runtime.requests.request_server import MAX_REQUESTS
from regraft.testing import Rig
from tests.kit.parts import Number
from tests.stepped.parts import TinyWorld
from tests.support.stepped.step_site import StepSite

TOO_MANY = 30
BURST = MAX_OVERLAPPING + 200
SLOW_ONES = MAX_OVERLAPPING - 1
LATER = Number(1_000_000)


class Slow(Component):
    """Takes ``lasts`` seconds for each message and each tick."""

    heard = Input(Number)
    lasts = Parameter(60.0, "time that each call takes", minimum=0.0, unit="s")

    def __init__(self) -> None:
        self.begun: list[int] = []
        self.ticks = 0
        self.answered = 0

    @heard.handler
    async def take(self, number: Number) -> None:
        self.begun.append(number.value)
        await self.kit.sleep(self.lasts)

    @every(seconds=100.0)
    async def look(self) -> None:
        self.ticks += 1
        await self.kit.sleep(1e6)

    @service("wait")
    async def wait(self, number: Number) -> Number:
        self.answered += 1
        await self.kit.sleep(self.lasts)
        return number


class Crowd(Component):
    """Asks many times at once."""

    many = Parameter(1, minimum=1)

    def on_activate(self) -> None:
        self.asked = [self.kit.call("wait", Number(value), Number, timeout=1000.0) for value in range(self.many)]


class Burst(Component):
    """Publishes many messages at once, twice."""

    numbers = Output(Number)

    def __init__(self) -> None:
        self.published = 0

    @every(seconds=1.0)
    def burst(self) -> None:
        for number in range(self.published, self.published + BURST):
            self.numbers.publish(Number(number))
        self.published += BURST


class Prompt(Component):
    """Is done with most messages at once; with the first ones it takes its time."""

    numbers = Input(Number)

    def __init__(self) -> None:
        self.begun: list[int] = []

    @numbers.handler
    async def take(self, number: Number) -> None:
        self.begun.append(number.value)
        if number.value < SLOW_ONES:
            await self.kit.sleep(1e6)


def _overruns(rig: Rig) -> list[str]:
    return [event.text.partition(":")[0] for event in rig.events if event.kind == "handler.overrun"]


def test_a_slow_handler_leaves_out_what_would_pile_up_and_counts_it() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for value in range(MAX_OVERLAPPING + TOO_MANY):
            rig.publish("heard", Number(value))
        assert slow.begun == list(range(MAX_OVERLAPPING))
        assert rig.status("slow").lost == TOO_MANY
        assert _overruns(rig) == ["input 'heard'"]


def test_a_handler_that_is_done_at_once_takes_however_many_come_together() -> None:
    steps = StepSite("memory")
    try:
        steps.start(Burst, "burst")
        steps.start(Prompt, "prompt")
        steps.start_world(TinyWorld, ("burst", "prompt"), 2.5)
        assert steps.wait_finished().reproducible
        prompt: Prompt = steps.component("prompt")
        assert prompt.begun == list(range(2 * BURST))
        assert steps.runtimes["prompt"].reporter.status.lost == 0
    finally:
        steps.close()


def test_a_slow_handler_takes_what_comes_when_calls_have_ended() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for value in range(MAX_OVERLAPPING + 1):
            rig.publish("heard", Number(value))
        rig.advance(slow.lasts)
        rig.publish("heard", LATER)
        assert slow.begun[-1] == LATER.value


def test_a_slow_handler_begins_anew_when_its_component_does() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for value in range(MAX_OVERLAPPING):
            rig.publish("heard", Number(value))
        rig.transition("slow", Transition.DEACTIVATE)
        rig.transition("slow", Transition.ACTIVATE)
        rig.publish("heard", LATER)
        assert slow.begun[-1] == LATER.value


def test_a_slow_timer_leaves_out_ticks() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for _ in range(MAX_OVERLAPPING + TOO_MANY):
            rig.advance(100.0)
        assert slow.ticks == MAX_OVERLAPPING
        assert _overruns(rig) == ["timer 'look'"]


def test_a_slow_service_refuses_what_would_pile_up_and_says_when_to_ask_again() -> None:
    with Rig() as rig:
        rig.add(Slow)
        crowd = rig.add(Crowd, parameters={"many": MAX_REQUESTS + 1})
        rig.advance(1.0)
        *waiting, refused = crowd.asked
        assert not any(one.done for one in waiting)
        assert isinstance(refused.error, CallFailed)
        assert (refused.error.answer, refused.error.code) == (Answer.REFUSED, RefusalCode.QUEUE_FULL)
        assert refused.error.retry_after
        rig.advance(60.0)
        assert [one.value for one in waiting] == [Number(value) for value in range(MAX_REQUESTS)]


def test_a_slow_service_is_no_less_bounded_with_more_clients_than_it_remembers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(request_server, "MAX_REQUESTS", 10)
    monkeypatch.setattr(request_server, "MAX_CLIENTS", 3)
    with Rig() as rig:
        rig.add(Slow)
        crowds = [rig.add(Crowd, f"crowd_{n}", {"many": 2}) for n in range(6)]
        rig.advance(1.0)
        assert [[one.done for one in crowd.asked] for crowd in crowds] == [[False, False]] * 5 + [[True, True]]


def test_a_request_under_way_is_carried_out_once_however_many_clients_ask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(request_server, "MAX_CLIENTS", 3)
    with Rig() as rig:
        slow = rig.add(Slow)
        crowds = [rig.add(Crowd, f"crowd_{n}") for n in range(6)]
        rig.advance(slow.lasts + 1.0)
        assert [crowd.asked[0].value for crowd in crowds] == [Number(0)] * 6
        assert slow.answered == 6


def test_a_request_that_was_refused_stays_so_when_it_comes_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(request_server, "MAX_REQUESTS", 1)
    with Rig() as rig:
        rig.add(Slow)
        keys, replies = Keys("rig"), []
        rig.bus.subscribe(keys.reply("wait", "tool"), lambda item: replies.append(rig.bus.open_sample(item)))
        ask = Writers(rig.bus, rig.clock, Identity("tool", 1, 1)).open(keys.request("wait"), type_of(Request).encoding)
        for number in (1, 2):
            ask.put(codec.encode(Request("tool", number, Verb.CALL, {"value": number})))
            rig.settle()
        rig.advance(60.0)
        ask.put(codec.encode(Request("tool", 2, Verb.CALL, {"value": 2})))
        rig.advance(60.0)
        answers = [codec.decode(sample.payload, Reply) for sample in replies if sample and sample.payload]
        assert [(one.number, one.answer) for one in answers] == [
            (2, Answer.REFUSED),
            (1, Answer.RESULT),
            (2, Answer.REFUSED),
        ]
