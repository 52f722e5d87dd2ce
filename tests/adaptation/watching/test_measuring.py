"""Measuring follows a component through adaptations: another class, another state."""

from __future__ import annotations

from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.model.adaptation import Add, ChangeState, Outcome, SetParameters, Swap
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import Transition
from regraft.client import TopicSample
from tests.adaptation.system import System
from tests.support.waiting import wait_until

GAUGE = "tests.qualities.parts:Gauge"


def test_a_successor_measures_in_its_predecessors_place(system: System) -> None:
    heard: list[MeasuredQualities] = []

    def hear(sample: TopicSample) -> None:
        heard.append(sample.message)

    with system.client.measurements("gauge", hear):
        assert system.adapt(Add("gauge", ComponentSpec(cls=GAUGE))).outcome is Outcome.APPLIED
        wait_until(lambda: bool(heard), "a first measurement")
        assert system.adapt(Swap("gauge", parameters={"mood": "nan"})).outcome is Outcome.APPLIED
        wait_until(lambda: heard[-1].incarnation > heard[0].incarnation, "a measurement of the successor")
        assert heard[-1].unknown == {"level": "nan: must be finite"}
    assert system.client.ask_measured("gauge").incarnation == heard[-1].incarnation


def test_what_does_not_act_has_measured_nothing(system: System) -> None:
    system.adapt(Add("gauge", ComponentSpec(cls=GAUGE)))
    wait_until(lambda: system.client.ask_measured("gauge").values == {"level": 0.5}, "a first measurement")
    assert system.adapt(ChangeState("gauge", Transition.DEACTIVATE)).outcome is Outcome.APPLIED
    assert system.client.ask_measured("gauge").unknown == {"level": "the component is inactive"}
    system.adapt(ChangeState("gauge", Transition.ACTIVATE))
    assert system.client.ask_measured("gauge").values in ({}, {"level": 0.5})


def test_a_dry_run_has_what_was_measured_and_that_it_will_not_hold(system: System) -> None:
    system.adapt(Add("gauge", ComponentSpec(cls="tests.adaptation.parts:Meter")))
    wait_until(lambda: system.client.ask_measured("gauge").values == {"level": 0.5}, "a first measurement")
    report = system.adapt(SetParameters("gauge", {"share": 0.1}), dry_run=True)
    assert report.estimate is not None
    (level,) = report.estimate.qualities
    assert (level.before, level.before_source.value) == (0.5, "measured")
    assert (level.after, level.after_source.value, level.after_why) == (None, "unknown", "only measured")
