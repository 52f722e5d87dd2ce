"""A component in simulated time handles what was kept for it in order, however little room its handler has."""

from __future__ import annotations

import pytest

from regraft import Component, Input
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.model.lifecycle import Transition
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until


class Pondering(Component):
    """Begins with each position at once, and takes a moment of simulated time for it."""

    position = Input(Reading)

    def __init__(self) -> None:
        self.begun: list[float] = []

    @position.handler
    async def see(self, position: Reading) -> None:
        self.begun.append(position.stamp)
        await self.kit.sleep(0.01)


def test_what_was_kept_is_handled_though_the_handler_is_full(steps: StepSite, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("regraft.runtime.core.overlap.MAX_OVERLAPPING", 3)
    steps.start(Pondering, "pondering")
    steps.start_world(TinyWorld, ("pondering",), 3600.0)
    steps.wait_for_time(0.5)
    steps.client.control("pondering", "transition", SetTransition(Transition.DEACTIVATE, hold=True))
    steps.wait_for_time(steps.told().time / 1e9 + 5.0)
    begun = steps.component("pondering").begun
    before = len(begun)
    steps.client.control("pondering", "transition", SetTransition(Transition.ACTIVATE))
    wait_until(lambda: len(begun) > before + 300, "what was kept, and more")
    ticks = [round(stamp / 0.05) for stamp in begun]
    assert ticks == [*range(ticks[0], ticks[0] + len(ticks))]
    assert steps.runtimes["pondering"].reporter.status.lost == 0
