"""A component that is started or ended in a slot joins and leaves between the same two ticks in every run."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from typing import ClassVar

import pytest

from regraft import Component, Input, Output, every
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.clock import ClockMember, Membership
from regraft.bus_schema.messages.protocol.control import ControlError, SetTransition
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.stepped.parts import Adviser, Pusher, Reading, TinyWorld, Witness
from tests.support.stepped.step_site import StepSite

MEMBERS = ("adviser", "pusher", "warden", "witness")


class Shadow(Component):
    """Follows the point: hears every position, and says what it has seen."""

    position = Input(Reading)
    shade = Output(Reading)

    def __init__(self) -> None:
        self.seen: list[tuple[float, float]] = []

    def on_activate(self) -> None:
        self.shade.publish(Reading(self.kit.now(), -1.0))

    @position.handler
    def follow(self, position: Reading) -> None:
        self.seen.append((self.kit.now(), position.value))
        self.shade.publish(Reading(self.kit.now(), position.value))


class Listener(Component):
    """Hears the shadow: at once, and late."""

    shade = Input(Reading, required=False)
    late = Input(Reading, topic="shade", required=False, keep=1000)

    def __init__(self) -> None:
        self.heard: list[tuple[float, float, float]] = []
        self.late_heard: list[tuple[float, float, float]] = []

    @shade.handler
    def hear(self, shade: Reading) -> None:
        self.heard.append((self.kit.now(), shade.stamp, shade.value))

    @every(seconds=0.7)
    def look(self) -> None:
        self.late_heard += [(self.kit.now(), shade.stamp, shade.value) for shade in self.late.take()]


class Warden(Component):
    """Starts a shadow in a slot, and ends it in another, again and again."""

    start: ClassVar[Callable[[int], None]]
    end: ClassVar[Callable[[], None]]

    def __init__(self) -> None:
        self.rounds = 0

    def on_activate(self) -> None:
        self.kit.spawn(self.work(), "work")

    async def work(self) -> None:
        while True:
            await self.kit.sleep(1.0)
            self.rounds += 1
            async with self.kit.exclusive() as slot:
                await self.kit.compute(type(self).start, self.rounds)
                while not await self._clock("admit"):
                    await self.kit.compute(threading.Event().wait, 0.002)
                for transition in (Transition.CONFIGURE, Transition.ACTIVATE):
                    await self._bring(transition)
                slot.touch("shadow")
            await self.kit.sleep(1.43)
            async with self.kit.exclusive() as slot:
                await self._bring(Transition.DEACTIVATE)
                slot.touch("shadow")
                assert not await self._clock("release")
                await self.kit.compute(type(self).end)

    async def _clock(self, verb: str) -> bool:
        run = codec.encode(ClockMember("shadow", self.rounds))
        (answer,) = await self.kit.ask(f"{self.kit.system}/clock/{verb}", run, 5.0)
        return codec.decode(answer.payload, Membership).member

    async def _bring(self, transition: Transition) -> None:
        key = f"{self.kit.system}/component/shadow/{self.rounds}/transition"
        (answer,) = await self.kit.ask(key, codec.encode(SetTransition(transition)), 5.0)
        assert not answer.error, answer.payload


def _digest(kind: str, delay: float) -> str:
    steps = StepSite(kind)
    shadows: list[Shadow] = []

    def start(incarnation: int) -> None:
        threading.Event().wait(delay * (incarnation % 3))
        steps.start(Shadow, "shadow", incarnation=incarnation, state=State.UNCONFIGURED)

    def end() -> None:
        shadows.append(steps.component("shadow"))
        steps.end("shadow")
        del steps.runtimes["shadow"]

    Warden.start, Warden.end = staticmethod(start), staticmethod(end)
    try:
        for cls, name in ((Pusher, "pusher"), (Adviser, "adviser"), (Witness, "witness"), (Warden, "warden")):
            steps.start(cls, name)
        steps.start(Listener, "listener")
        steps.start_world(TinyWorld, (*MEMBERS, "listener"), 12.0)
        told = steps.wait_finished()
        assert told.reproducible, told
        assert told.dropped == ()
        warden: Warden = steps.component("warden")
        listener: Listener = steps.component("listener")
        assert warden.rounds == 5
        said = [-1.0 if n == 0 else value for shadow in shadows for n, (_, value) in enumerate([(0, 0), *shadow.seen])]
        heard = [value for *_, value in listener.heard]
        assert heard[: len(said)] == said
        late = [value for *_, value in listener.late_heard]
        assert late == heard[: len(late)]
        assert len(late) > 100
        everything = [steps.component("witness").seen, [s.seen for s in shadows], listener.heard, listener.late_heard]
        return hashlib.sha256(repr(everything).encode()).hexdigest()
    finally:
        steps.close()


def test_who_is_started_and_ended_in_slots_leaves_equal_runs_equal_and_loses_nothing() -> None:
    runs = {_digest("memory", 0.0), _digest("memory", 0.05), _digest("zenoh", 0.0), _digest("zenoh", 0.05)}
    assert len(runs) == 1


@pytest.mark.parametrize("verb", ["admit", "release", "succeed"])
def test_nobody_is_admitted_released_or_succeeded_outside_of_a_slot(steps: StepSite, verb: str) -> None:
    steps.start(Adviser, "adviser")
    steps.start_world(TinyWorld, ("adviser",), 3600.0)
    steps.wait_for_time(1.0)
    bus = steps.runtimes["adviser"].bus
    (answer,) = bus.query(f"steps/clock/{verb}", codec.encode(ClockMember("adviser", 1)), 5.0)
    assert answer.error
    assert "in a slot only" in codec.decode(answer.payload, ControlError).problems[0]
    assert "adviser" in steps.told().members
