"""Reparameterisation."""

from __future__ import annotations

from regraft.bus_schema.model.adaptation import Outcome, SetParameters, StepState
from tests.adaptation.system import System


def test_parameters_of_several_components_are_set_and_read_back(system: System) -> None:
    report = system.adapt(
        SetParameters("listener", {"gain": 0.25, "label": "fancy"}), SetParameters("fragile", {"level": 3})
    )
    assert (report.outcome, report.revision_before, report.revision_after) == (Outcome.APPLIED, 1, 2)
    assert [step.state for step in report.steps] == [StepState.DONE, StepState.DONE]
    assert system.view("listener").parameters["gain"] == 0.25
    assert system.view("listener").parameters["label"] == "fancy"
    assert system.view("fragile").parameters["level"] == 3
    assert system.view("listener").revision == 2
    assert system.host.specs["listener"].parameters == {"gain": 0.25, "label": "fancy"}
    assert system.host.revision == 2


def test_a_failing_second_step_undoes_the_first(system: System) -> None:
    assert system.adapt(SetParameters("fragile", {"mood": "refuses"})).outcome is Outcome.APPLIED
    before = system.views()
    report = system.adapt(SetParameters("listener", {"gain": 0.9}), SetParameters("fragile", {"level": 5}))
    assert report.outcome is Outcome.ROLLED_BACK
    assert [step.state for step in report.steps] == [StepState.UNDONE, StepState.UNDONE]
    assert "not in this mood" in report.error
    assert system.views() == before
    assert report.revision_after == 2
