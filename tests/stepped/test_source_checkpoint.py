"""A source of time that dies goes on where it was, or repeats its last moment: time never goes back."""

from __future__ import annotations

import math

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.control import Snapshot
from tests.stepped.parts import Reading, TinyWorld
from tests.stepped.test_promises import Viewer
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until

KEYS = Keys("steps")
TICK = 0.05
TICKS = 100
LAST_GOOD = 1.01


class LastingWorld(TinyWorld):
    """One that can go on after its death."""

    def snapshot(self) -> dict[str, float]:
        return {"x": self.x, "v": self.v}


def test_the_checkpoint_of_a_tick_is_out_before_anything_of_the_next(steps: StepSite) -> None:
    checkpoints: list[float] = []
    behind: list[float] = []

    def heard(sample: Sample) -> None:
        if sample.key == KEYS.checkpoint("world"):
            checkpoints.append(codec.decode(sample.payload, Snapshot).stamp)
        elif sample.key == KEYS.topic("position") and checkpoints:
            behind.append(codec.decode(sample.payload, Reading).stamp - checkpoints[-1])

    steps.listen("steps/**", heard)
    steps.start(Viewer, "viewer")
    steps.start_world(LastingWorld, ("viewer",), TICK * TICKS)
    steps.wait_finished()
    wait_until(lambda: len(checkpoints) == TICKS)
    assert max(behind) < 1.5 * TICK


class FailingWorld(LastingWorld):
    """One that fails by itself in a tick, in which its state is of no use any more."""

    def advance(self, tick: int, seconds: float) -> None:
        super().advance(tick, seconds)
        if self.kit.now() > LAST_GOOD:
            self.x = math.nan
            self.kit.fail("the floor is gone")


def test_a_source_that_fails_keeps_the_checkpoint_of_the_tick_before(steps: StepSite) -> None:
    checkpoints: list[Snapshot] = []
    failed: list[Event] = []

    def heard(sample: Sample) -> None:
        if sample.key == KEYS.checkpoint("world"):
            checkpoints.append(codec.decode(sample.payload, Snapshot))
        elif sample.key == KEYS.event and (event := codec.decode(sample.payload, Event)).kind == "component.failed":
            failed.append(event)

    steps.listen("steps/**", heard)
    steps.start_world(FailingWorld, (), TICK * TICKS)
    wait_until(lambda: failed)
    assert checkpoints[-1].stamp < LAST_GOOD + TICK / 2
