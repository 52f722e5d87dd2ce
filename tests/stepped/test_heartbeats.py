"""A step that has much to do keeps its heartbeat: only a handler that does not return is hung."""

from __future__ import annotations

import time

import pytest

from regraft import Component, every
from tests.stepped.parts import TinyWorld
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


def test_timers_that_are_due_in_one_step_do_not_add_up_to_silence(
    steps: StepSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps.start(Thorough, "thorough", heartbeat=HEARTBEAT)
    wait_until(lambda: "thorough" in steps.runtimes, "the component")
    thorough, reporter = steps.component("thorough"), steps.runtimes["thorough"].reporter
    beat = reporter.beat

    def count() -> None:
        thorough.beats.append(reporter.next_beat)
        beat()

    monkeypatch.setattr(reporter, "beat", count)
    steps.start_world(TinyWorld, ("thorough",), 1.0)
    steps.wait_finished()
    first, second, third = thorough.beats_by_then[-3:]
    assert first < second < third
