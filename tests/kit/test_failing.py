"""A component fails by itself: it is unconfigured then, everybody can see why, and nobody brings it back unasked."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft import Component, Input, Output, Parameter, every, service
from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.errors import CallFailed
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.testing import Rig

PLACES = ("nowhere", "handler", "timer", "task", "activate", "error", "parameters", "raises", "cleanup")


class Pump(Component):
    """Fails where it is told to."""

    heard = Input(Twist, topic="numbers", required=False)
    said = Output(Twist, topic="said")
    where = Parameter("nowhere", choices=PLACES)

    def on_configure(self) -> None:
        self.heard_since = 0
        self.errors = 0
        self.cancelled = False

    def on_activate(self) -> None:
        self.kit.spawn(self.work(), "working")
        self._fail_in("activate")
        self._fail_in("raises")
        if self.where == "raises":
            raise OSError("no pump")

    def on_error(self) -> None:
        self.errors += 1
        self._fail_in("error")
        self.kit.spawn(self.mend(), "mending")

    def on_parameters(self, changed: frozenset[str]) -> None:
        self._fail_in("parameters")

    async def mend(self) -> None:
        await self.kit.sleep(5.0)
        self.kit.recovered()

    async def work(self) -> None:
        try:
            await self.kit.sleep(1.0)
            self._fail_in("task")
            await self.kit.sleep(1000.0)
        finally:
            self.cancelled = True
            self._fail_in("cleanup")

    @heard.handler
    def hear(self, message: Twist) -> None:
        self.heard_since += 1
        if self.where in ("handler", "error", "cleanup") and message.linear.x == 13.0:
            self.kit.fail("the pump is dry")
        self.said.publish(message)

    @every(seconds=1.0)
    def look(self) -> None:
        self._fail_in("timer")

    @every(seconds=1.0)
    def look_again(self) -> None:
        assert self.kit.now() < 1.5 or self.where != "timer", "a failed component acts no more"
        self.looked = True

    @service("ask")
    def ask(self, request: Twist) -> Twist:
        """Give it back."""
        return request

    def _fail_in(self, here: str) -> None:
        if self.where == here:
            self.kit.fail("the pump is dry")


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig() as rig:
        yield rig


def _pump(rig: Rig, where: str) -> Pump:
    pump = rig.add(Pump, name="pump", parameters={"where": where})
    assert isinstance(pump, Pump)
    return pump


def _events(rig: Rig, kind: str) -> list[dict[str, object]]:
    return [event.details for event in rig.events if event.kind == kind]


def _number(value: float) -> Twist:
    return Twist(Vector3(value))


def test_a_hook_that_says_why_and_raises_leaves_the_component_unconfigured(rig: Rig) -> None:
    pump = rig.add(Pump, "pump", {"where": "raises"}, state=State.INACTIVE)
    with pytest.raises(TransitionFailed, match="no pump"):
        rig.transition("pump", Transition.ACTIVATE)
    rig.advance(0.1)
    assert rig.state("pump") is State.UNCONFIGURED
    assert pump.errors == 1
    assert rig.take_faults() == ["pump: on_activate: OSError: no pump"]


@pytest.mark.parametrize("where", ["handler", "timer", "task", "cleanup"])
def test_a_component_that_fails_is_unconfigured_and_says_why(rig: Rig, where: str) -> None:
    pump = _pump(rig, where)
    rig.publish("numbers", _number(13.0))
    rig.advance(1.2)
    assert rig.state("pump") is State.UNCONFIGURED
    assert pump.errors == 1
    assert pump.cancelled
    assert _events(rig, "component.failed") == [{"code": "failed", "state": "unconfigured"}]
    status = rig.status("pump")
    assert (status.state, status.failure) == (State.UNCONFIGURED, "the pump is dry")


def test_the_handler_that_fails_ends_and_no_other_begins(rig: Rig) -> None:
    pump = _pump(rig, "handler")
    said = rig.collect("said", Twist)
    for value in (1.0, 13.0, 2.0):
        rig.publish("numbers", _number(value))
    assert pump.heard_since == 2
    assert [message.linear.x for message in said] == [1.0, 13.0]
    with pytest.raises(CallFailed, match="unconfigured"):
        rig.call("ask", _number(1.0), Twist)


def test_timers_that_are_due_with_the_one_that_fails_are_not_called(rig: Rig) -> None:
    pump = _pump(rig, "timer")
    rig.advance(1.2)
    assert not hasattr(pump, "looked")


def test_nobody_brings_it_back_unasked_and_configuring_it_again_is_seen(rig: Rig) -> None:
    _pump(rig, "handler")
    rig.publish("numbers", _number(13.0))
    rig.advance(3.0)
    assert rig.state("pump") is State.UNCONFIGURED
    rig.transition("pump", Transition.CONFIGURE)
    assert rig.state("pump") is State.INACTIVE
    assert _events(rig, "component.recovered") == [{"code": "configured"}]
    assert rig.status("pump").failure == ""
    rig.advance(5.0)
    assert len(_events(rig, "component.recovered")) == 1, "it has recovered already"


def test_a_component_reports_by_itself_that_what_failed_is_over(rig: Rig) -> None:
    _pump(rig, "handler")
    rig.publish("numbers", _number(13.0))
    rig.advance(6.0)
    assert rig.state("pump") is State.UNCONFIGURED
    assert _events(rig, "component.recovered") == [{"code": "by_itself"}]
    assert rig.status("pump").failure == ""


def test_a_component_that_fails_as_it_recovers_is_finalized(rig: Rig) -> None:
    _pump(rig, "error")
    rig.publish("numbers", _number(13.0))
    assert rig.state("pump") is State.FINALIZED
    assert _events(rig, "component.failed") == [{"code": "failed", "state": "finalized"}]
    assert rig.take_faults() == ["pump: on_error: ComponentFailed: the pump is dry"]


def test_a_hook_that_fails_its_component_fails_its_transition(rig: Rig) -> None:
    _pump(rig, "activate")
    assert rig.state("pump") is State.UNCONFIGURED
    assert _events(rig, "component.failed") == [{"code": "failed", "state": "unconfigured"}]
    assert len(rig.take_faults()) == 1


def test_a_component_that_has_not_failed_has_nothing_to_recover_from(rig: Rig) -> None:
    pump = _pump(rig, "nowhere")
    pump.kit.recovered()
    rig.advance(1.0)
    assert rig.state("pump") is State.ACTIVE
    assert _events(rig, "component.recovered") == []
