"""Components read in step what others measure: in its tick, as long as it counts, and only where it is wanted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import pytest

from regraft import Component, Input, Parameter, Quality
from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import SystemFaults, SystemMeasurements
from regraft.bus_schema.messages.protocol.clock import Ack
from regraft.testing import Rig
from tests.services.rigs import set_parameters
from tests.stepped.parts import Reading, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until

TOPIC = {"measurements": "system/measurements"}


class Meter(Component):
    """Measures the time and a share of it, twice a second."""

    evaluate_every: ClassVar[float | None] = 0.5

    position = Input(Reading)
    share = Parameter(0.5, minimum=0.0, maximum=1.0)

    level = Quality(minimum=0.0, maximum=1.2, estimated=False)

    def evaluate(self) -> dict[str, float]:
        return {"level": self.kit.now() * self.share}


class Reader(Component):
    """Writes down what others measure, and when it hears of it."""

    measurements = Input(SystemMeasurements, topic="system/measurements", required=False)

    def __init__(self) -> None:
        self.seen: list[tuple[float, dict[str, Any]]] = []

    @measurements.handler
    def see(self, message: SystemMeasurements) -> None:
        found = {each.component: each.values.get("level", each.unknown.get("level")) for each in message.components}
        self.seen.append((self.kit.now(), found))


class FaultReader(Component):
    """Reads faults alone."""

    faults = Input(SystemFaults, topic="system/faults", latest_only=True, required=False)


@pytest.fixture
def steps() -> Iterator[StepSite]:
    """Members on the bus in memory."""
    made = StepSite("memory")
    yield made
    made.close()


def read(kind: str) -> list[tuple[float, dict[str, Any]]]:
    """Return what a reader has heard in a run of three seconds."""
    steps = StepSite(kind)
    try:
        steps.start(Meter, "meter", connections={"position": "position"})
        steps.start(Reader, "reader", connections=TOPIC)
        steps.start_world(TinyWorld, ("meter", "reader"), 3.0)
        assert steps.wait_finished().reproducible
        reader: Reader = steps.component("reader")
        return reader.seen
    finally:
        steps.close()


def test_what_is_measured_is_read_in_its_tick_and_the_same_in_every_run() -> None:
    runs = [read(kind) for kind in ("memory", "zenoh")]
    assert runs[0] == runs[1]
    measured = [(at, found["meter"]) for at, found in runs[0] if found]
    assert measured == [
        (0.5, 0.25),
        (1.0, 0.5),
        (1.5, 0.75),
        (2.0, 1.0),
        (2.5, "1.25: must be at most 1.2 1"),
        (3.0, "1.5: must be at most 1.2 1"),
    ]


def test_what_a_component_measured_is_gone_from_the_tick_in_which_it_dies(steps: StepSite) -> None:
    steps.start(Meter, "meter", connections={"position": "position"})
    steps.start(Reader, "reader", connections=TOPIC)
    steps.start_world(TinyWorld, ("meter", "reader"), 3600.0)
    steps.wait_for_time(1.0)
    steps.kill("meter")
    reader: Reader = steps.component("reader")
    wait_until(lambda: reader.seen[-1][1] == {}, "the measurement to be gone")


def test_a_reader_that_comes_late_gets_what_was_measured_last_at_once(steps: StepSite) -> None:
    class Seldom(Meter):
        """Measures once in a while."""

        evaluate_every: ClassVar[float | None] = 20.0

    class LateReader(Reader):
        """Knows since when it reads."""

        def on_activate(self) -> None:
            self.since = self.kit.now()

    steps.start(Seldom, "meter", connections={"position": "position"})
    steps.start_world(TinyWorld, ("meter",), 100_000.0)
    steps.wait_for_time(20.0)
    steps.start(LateReader, "late", connections=TOPIC)
    wait_until(lambda: "late" in steps.runtimes and steps.component("late").seen, "the reader to hear of it")
    late: LateReader = steps.component("late")
    assert late.seen[0][0] == late.since


@pytest.mark.parametrize("reads", [FaultReader, Reader])
def test_members_report_measurements_only_where_somebody_reads_them(reads: type[Component]) -> None:
    steps, acks, published = StepSite("memory"), list[Ack](), list[Sample]()
    try:
        steps.listen("steps/clock/ack", lambda sample: acks.append(codec.decode(sample.payload, Ack)))
        steps.listen("steps/topic/system/measurements", published.append)
        steps.start(Meter, "meter", connections={"position": "position"})
        port = "faults" if reads is FaultReader else "measurements"
        steps.start(reads, "reader", connections={port: f"system/{port}"})
        steps.start_world(TinyWorld, ("meter", "reader"), 2.0)
        assert steps.wait_finished().reproducible
        told = [ack for ack in acks if ack.news is not None and ack.news.measured is not None]
        assert (len(told) > 0, len(published) > 0) == (reads is Reader, reads is Reader)
    finally:
        steps.close()


def test_a_measurement_belongs_to_the_parameters_under_which_it_was_taken() -> None:
    with Rig() as rig:
        rig.add(Meter, "meter", connections={"position": "position"})
        published: list[MeasuredQualities] = rig.collect_qualities("meter")
        rig.advance(1.0)
        set_parameters(rig, "meter", share=0.2)
        assert published[-1].unknown == {"level": "not measured since parameters have changed"}
        rig.advance(0.5)
        assert published[-1].values == {"level": pytest.approx(0.3)}
