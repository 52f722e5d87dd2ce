"""A step that has much to do keeps its heartbeat: only a handler that does not return is hung."""

from __future__ import annotations

import time

import pytest

from regraft import Component, Input, every
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.model.lifecycle import Transition
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until

HEARTBEAT = 0.02


class Thorough(Component):
    """Has three timers due at the same time, each of which takes longer than a heartbeat may stay away."""

    def __init__(self) -> None:
        self.beats: list[float] = []
        self.beats_by_then: list[int] = []

    def _work(self) -> None:
        self.beats_by_then.append(len(self.beats))
        time.sleep(2 * HEARTBEAT)  # the work itself: nothing is waited for

    @every(seconds=1.0)
    def first(self) -> None:
        self._work()

    @every(seconds=1.0)
    def second(self) -> None:
        self._work()

    @every(seconds=1.0)
    def third(self) -> None:
        self._work()


class Missing(Component):
    """Takes long for three positions, once it has been on hold."""

    position = Input(Reading)

    def __init__(self) -> None:
        self.beats: list[float] = []
        self.beats_by_then: list[int] = []
        self.rested = False

    def on_deactivate(self) -> None:
        self.rested = True

    @position.handler
    def see(self, position: Reading) -> None:
        if self.rested and len(self.beats_by_then) < 3:
            self.beats_by_then.append(len(self.beats))
            time.sleep(2 * HEARTBEAT)  # the work itself: nothing is waited for


def _start(steps: StepSite, monkeypatch: pytest.MonkeyPatch, cls: type[Component], name: str) -> None:
    """Start a component that notes its heartbeats."""
    steps.start(cls, name, heartbeat=HEARTBEAT)
    wait_until(lambda: name in steps.runtimes, "the component")
    component, reporter = steps.component(name), steps.runtimes[name].reporter
    beat = reporter.beat

    def count() -> None:
        component.beats.append(reporter.next_beat)
        beat()

    monkeypatch.setattr(reporter, "beat", count)


def test_messages_that_were_kept_do_not_add_up_to_silence(steps: StepSite, monkeypatch: pytest.MonkeyPatch) -> None:
    _start(steps, monkeypatch, Missing, "missing")
    steps.start_world(TinyWorld, ("missing",), 3600.0)
    steps.wait_for_time(0.5)
    steps.client.control("missing", "transition", SetTransition(Transition.DEACTIVATE, hold=True))
    steps.wait_for_time(steps.told().time / 1e9 + 1.0)
    steps.client.control("missing", "transition", SetTransition(Transition.ACTIVATE))
    first, second, third = steps.component("missing").beats_by_then
    assert first < second < third


def test_timers_that_are_due_in_one_step_do_not_add_up_to_silence(
    steps: StepSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    _start(steps, monkeypatch, Thorough, "thorough")
    thorough = steps.component("thorough")
    steps.start_world(TinyWorld, ("thorough",), 1.0)
    steps.wait_finished()
    first, second, third = thorough.beats_by_then[-3:]
    assert first < second < third
