"""What the rig for component tests promises."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext
from typing import Any

import pytest

from regraft import CallFailed, Component, Input, Output, Parameter
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.testing import Rig
from tests.kit.parts import Asker, Counter, Echo, Number, Oracle, Walker


def test_a_timer_ticks_when_the_test_moves_the_clock() -> None:
    with Rig() as rig:
        counter = rig.add(Counter, parameters={"rate": 10.0})
        rig.advance(1.0)
        assert counter.value == 10


def test_time_passes_until_something_holds_or_the_test_is_stopped() -> None:
    with Rig() as rig:
        counter = rig.add(Counter, parameters={"rate": 10.0})
        rig.advance_until(lambda: counter.value == 5)
        assert 0.4 <= rig.clock.now() / 1e9 <= 0.51
        with pytest.raises(TimeoutError, match="within 2 s"):
            rig.advance_until(lambda: counter.value < 0, timeout=2.0)
        assert counter.value == 25


def test_messages_are_handled_at_once() -> None:
    with Rig() as rig:
        rig.add(Echo)
        said = rig.collect("said", Number)
        rig.publish("heard", Number(5))
        assert said == [Number(5)]


def test_calls_and_goals_take_the_time_they_take() -> None:
    with Rig() as rig:
        rig.add(Oracle)
        walker = rig.add(Walker)
        assert rig.call("double", Number(2), Number) == Number(4)
        assert rig.call("slow", Number(200), Number) == Number(200)
        goal = rig.goal("walk", Number(5), Number, Number)
        rig.advance(0.1)
        assert goal.result == Number(5)
        assert walker.ended == ["arrived"]


def test_components_talk_to_each_other() -> None:
    with Rig() as rig:
        rig.add(Oracle)
        rig.add(Asker)
        answers = rig.collect("answers", Number)
        rig.publish("question", Number(8))
        rig.advance(0.01)
        assert answers == [Number(16)]


def test_a_missing_service_fails_after_its_time() -> None:
    with Rig() as rig, pytest.raises(CallFailed, match="nobody"):
        rig.call("nothing", Number(1), Number, timeout=0.5)


def test_a_second_component_of_a_name_is_refused_and_one_of_another_name_is_not() -> None:
    with Rig() as rig:
        first = rig.add(Counter, parameters={"rate": 10.0})
        with pytest.raises(ValueError, match="component 'counter' already"):
            rig.add(Counter)
        second = rig.add(Counter, "other", parameters={"rate": 20.0})
        rig.advance(1.0)
        assert (first.value, second.value) == (10, 20)


class Wheels(Component):
    """Stands still when it is deactivated."""

    speed = Output(Number)

    def on_deactivate(self) -> None:
        self.speed.publish(Number(0))


@pytest.mark.parametrize("transition", [Transition.DEACTIVATE, Transition.SHUTDOWN])
def test_a_component_has_its_last_word_however_it_is_stopped(transition: Transition) -> None:
    with Rig() as rig:
        rig.add(Wheels)
        said = rig.collect("speed", Number)
        rig.transition("wheels", transition)
        assert said == [Number(0)]


def test_states_can_be_walked_through() -> None:
    with Rig() as rig:
        counter = rig.add(Counter, state=State.INACTIVE)
        rig.advance(1.0)
        assert counter.value == 0
        rig.transition("counter", Transition.ACTIVATE)
        rig.advance(1.0)
        assert counter.value == 50


def test_author_faults_are_seen_as_events() -> None:
    with Rig() as rig:
        rig.add(Oracle)
        with pytest.raises(CallFailed):
            rig.call("break", Number(1), Number)
        assert [event.kind for event in rig.events if event.kind == "component.fault"] == ["component.fault"]
        assert rig.take_faults() == ["oracle: break: ZeroDivisionError: by design"]
        assert rig.take_faults() == []


class Unlucky(Component):
    """Has an exception for every number."""

    heard = Input(Number)

    @heard.handler
    def hear(self, number: Number) -> None:
        raise ValueError(f"unlucky: {number.value}")


def test_every_fault_is_taken_also_when_they_come_at_once() -> None:
    with Rig() as rig:
        rig.add(Unlucky)
        for value in (13, 17, 13):
            rig.publish("heard", Number(value))
        assert rig.take_faults() == [f"unlucky: heard: ValueError: unlucky: {value}" for value in (13, 17, 13)]


class Unready(Component):
    """Cannot be configured."""

    def on_configure(self) -> None:
        raise ValueError("not ready")


def test_a_state_that_is_not_reached_is_a_fault_too() -> None:
    with Rig() as rig:
        rig.add(Unready)
        raised, missed = rig.take_faults()
        assert raised == "unready: on_configure: ValueError: not ready"
        assert missed.startswith("unready: did not become active: ")


class Reader(Component):
    """Reads the topics that its parameter names, one message after another."""

    topics = Parameter(("left", "right"), read_only=True)

    def __init__(self) -> None:
        self.heard: list[tuple[str, int]] = []

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any]]:
        for topic in parameters["topics"]:
            yield Input(Number, name=topic, topic=topic, handler="hear", origin="a topic of `topics`")

    async def hear(self, port: str, number: Number) -> None:
        await self.kit.sleep(0.1)
        self.heard.append((port, number.value))


def test_an_asynchronous_handler_of_several_inputs_is_carried_out() -> None:
    with Rig() as rig:
        reader = rig.add(Reader)
        rig.publish("left", Number(1))
        rig.publish("right", Number(2))
        assert reader.heard == []
        rig.advance(0.1)
        assert reader.heard == [("left", 1), ("right", 2)]


def _break(*, expected: type[Exception] | None) -> None:
    """Have a component raise in a test that expects that, or does not."""
    with Rig() as rig:
        rig.add(Oracle)
        with pytest.raises(expected) if expected else nullcontext():
            rig.call("break", Number(1), Number)


def test_a_fault_that_the_test_has_not_taken_is_raised_at_the_end() -> None:
    with pytest.raises(AssertionError, match="oracle: break: ZeroDivisionError: by design"):
        _break(expected=CallFailed)


def test_the_tests_own_failure_is_not_hidden_by_a_fault() -> None:
    with pytest.raises(CallFailed):
        _break(expected=None)
