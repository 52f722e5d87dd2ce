"""Asynchronous handlers that are slower than what comes in: nothing piles up, and it is reported."""

from __future__ import annotations

from regraft import CallFailed, Component, Input, Parameter, RefusalCode, every, service
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.lifecycle import Transition
from regraft.runtime.core.overlap import MAX_OVERLAPPING
from regraft.runtime.requests.request_server import MAX_REQUESTS
from regraft.testing import Rig
from tests.kit.parts import Number

TOO_MANY = 30


class Slow(Component):
    """Takes ``lasts`` seconds for each message and each tick."""

    heard = Input(Number)
    lasts = Parameter(60.0, "time that each call takes", minimum=0.0, unit="s")

    def __init__(self) -> None:
        self.begun: list[int] = []
        self.ticks = 0

    @heard.handler
    async def take(self, number: Number) -> None:
        self.begun.append(number.value)
        await self.kit.sleep(self.lasts)

    @every(seconds=100.0)
    async def look(self) -> None:
        self.ticks += 1
        await self.kit.sleep(20_000.0)

    @service("wait")
    async def wait(self, number: Number) -> Number:
        await self.kit.sleep(self.lasts)
        return number


class Crowd(Component):
    """Asks more at once than a service takes."""

    def on_activate(self) -> None:
        numbers = range(MAX_REQUESTS + 1)
        self.asked = [self.kit.call("wait", Number(value), Number, timeout=1000.0) for value in numbers]


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


def test_a_slow_handler_takes_what_comes_when_calls_have_ended() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for value in range(MAX_OVERLAPPING + 1):
            rig.publish("heard", Number(value))
        rig.advance(slow.lasts)
        rig.publish("heard", Number(1000))
        assert slow.begun[-1] == 1000


def test_a_slow_handler_begins_anew_when_its_component_does() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for value in range(MAX_OVERLAPPING):
            rig.publish("heard", Number(value))
        rig.transition("slow", Transition.DEACTIVATE)
        rig.transition("slow", Transition.ACTIVATE)
        rig.publish("heard", Number(1000))
        assert slow.begun[-1] == 1000


def test_a_slow_timer_leaves_out_ticks() -> None:
    with Rig() as rig:
        slow = rig.add(Slow)
        for _ in range(MAX_OVERLAPPING + TOO_MANY):
            rig.advance(100.0)
        assert slow.ticks == MAX_OVERLAPPING
        assert _overruns(rig) == ["timer 'look'"]


def test_a_slow_service_refuses_as_busy_what_would_pile_up() -> None:
    with Rig() as rig:
        rig.add(Slow)
        crowd = rig.add(Crowd)
        rig.advance(1.0)
        *waiting, refused = crowd.asked
        assert not any(one.done for one in waiting)
        assert isinstance(refused.error, CallFailed)
        assert (refused.error.answer, refused.error.code) == (Answer.REFUSED, RefusalCode.BUSY)
        rig.advance(60.0)
        assert [one.value for one in waiting] == [Number(value) for value in range(MAX_REQUESTS)]
