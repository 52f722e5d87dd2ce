"""Reading faults costs nothing as long as none happens: no message more, and no step."""

from __future__ import annotations

from collections import Counter

import pytest

from regraft import Component, Input, every
from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.system import SystemFaults
from regraft.bus_schema.messages.protocol.clock import Ack
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite

MEMBERS = ("reader", "worker")


class Worker(Component):
    """Works in every tick."""

    position = Input(Reading)

    @every(seconds=0.05)
    def work(self) -> None:
        pass


class Faulty(Worker):
    """Raises once, at 0.5 s."""

    def __init__(self) -> None:
        self.raised = False

    @every(seconds=0.05)
    def work(self) -> None:
        if self.kit.now() >= 0.5 and not self.raised:
            self.raised = True
            raise RuntimeError("a hiccup")


class FaultReader(Component):
    """Handles faults, as the adaptation manager does."""

    faults = Input(SystemFaults, topic="system/faults", required=False)

    @faults.handler
    def hear(self, faults: SystemFaults) -> None:
        pass


def told(worker: type[Component], seconds: float, *, reads: bool) -> tuple[Counter[str], list[Ack]]:
    """Return how many messages there were at each key of a run, and all acknowledgements."""
    steps, counts, acks = StepSite("memory"), Counter[str](), list[Ack]()

    def heard(sample: Sample) -> None:
        if sample.payload:
            counts[sample.key.removeprefix("steps/")] += 1
        if sample.key == "steps/clock/ack":
            acks.append(codec.decode(sample.payload, Ack))

    try:
        for keys in ("steps/clock/ack", "steps/clock/step/*", "steps/topic/**"):
            steps.listen(keys, heard)
        steps.start(worker, "worker", connections={"position": "position"})
        steps.start(FaultReader, "reader", connections={"faults": "system/faults" if reads else None})
        steps.start_world(TinyWorld, MEMBERS, seconds)
        assert steps.wait_finished().reproducible
    finally:
        steps.close()
    return counts, acks


@pytest.mark.usefixtures("all_sent_once")
def test_a_reader_of_faults_costs_no_message_in_a_tick_without_a_fault() -> None:
    further = {}
    for seconds in (1.0, 4.0):
        (reading, _), (silent, _) = (told(Worker, seconds, reads=reads) for reads in (True, False))
        assert reading["topic/position"] == silent["topic/position"]
        further[seconds] = {key: reading[key] - silent[key] for key in reading | silent}
    assert further[1.0] == further[4.0]


def test_members_say_nothing_of_themselves_in_a_tick_without_news() -> None:
    news = {}
    for seconds in (1.0, 4.0):
        _, acks = told(Worker, seconds, reads=True)
        found = [(ack.member, ack.news) for ack in acks if ack.news is not None]
        news[seconds] = sorted(found, key=lambda each: each[0])  # members acknowledge a step in any order
    assert news[1.0] == news[4.0]
    assert all(each.state is not None for _, each in news[4.0])


@pytest.mark.parametrize(("worker", "messages"), [(Worker, 1), (Faulty, 2)])
def test_faults_are_published_to_a_new_reader_and_when_one_happens(worker: type[Component], messages: int) -> None:
    counts, _ = told(worker, 2.0, reads=True)
    assert counts["topic/system/faults"] == messages
