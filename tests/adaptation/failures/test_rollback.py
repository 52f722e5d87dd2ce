"""Whatever fails after the check is undone."""

from __future__ import annotations

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import ChangeState, Connect, Outcome, SetParameters, StepState
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.parts import Fragile
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE, wait_until


def test_a_hung_component_leads_to_rolled_back_within_its_bound(impatient: System) -> None:
    system = impatient
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    report = system.adapt(
        SetParameters("listener", {"gain": 0.9}),
        Connect("listener", "heard", "others"),
        SetParameters("fragile", {"level": 5}),
    )
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "no answer within 0.4 s" in report.error
    assert system.view("listener").parameters["gain"] == 0.5
    assert system.view("listener").connections["heard"] == "numbers"
    Fragile.release.set()
    wait_until(lambda: system.view("fragile").parameters["level"] == 0)


def test_the_managers_patience_can_be_changed_while_it_runs(system: System) -> None:
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    system.set_parameters("manager", {"answer_within": 0.3, "undo_within": 0.5})
    report = system.adapt(SetParameters("fragile", {"level": 5}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "no answer within 0.3 s" in report.error
    Fragile.release.set()
    wait_until(lambda: system.view("fragile").parameters["level"] == 0)


def test_a_component_that_dies_half_way_leads_to_rolled_back(impatient: System) -> None:
    system = impatient
    before = system.views()
    fragile = system.running["fragile"]
    system.adapt(SetParameters("fragile", {"mood": "dies"}))

    def die() -> None:
        Fragile.release.set()
        fragile.thread.join(PATIENCE)
        system.host.ended("fragile")

    wanted = (SetParameters("listener", {"gain": 0.9}), SetParameters("fragile", {"level": 5}))
    pending = system.adapt(*wanted, wait=False)
    wait_until(lambda: fragile.runtime.parameters.values["level"] == 5)
    die()
    wait_until(lambda: system.lines(id=pending.id).entries[0].outcome is not Outcome.PENDING)
    (report,) = system.lines(id=pending.id).entries
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert system.view("listener").parameters == before["listener"][2]
    assert "level" not in system.host.specs["fragile"].parameters


def test_a_host_that_refuses_the_specs_leads_to_rolled_back_and_then_to_stuck(system: System) -> None:
    before = system.views()
    system.host.refuse = "not today"
    report = system.adapt(SetParameters("listener", {"gain": 0.9}))
    assert report.outcome is Outcome.STUCK
    assert "the former specs of listener" in report.error
    assert "not today" in report.error
    assert report.steps[0].state is StepState.UNDONE
    assert system.views() == before


def test_what_cannot_be_undone_is_said_to_be_stuck(system: System) -> None:
    system.adapt(SetParameters("fragile", {"mood": "fails"}))
    system.host.refuse = "not today"
    report = system.adapt(SetParameters("listener", {"gain": 0.9}), ChangeState("fragile", Transition.DEACTIVATE))
    assert report.outcome is Outcome.STUCK
    assert "cannot be activated in this mood" in report.error
    assert [step.state for step in report.steps] == [StepState.UNDONE, StepState.UNDO_FAILED]
    assert system.view("listener").parameters["gain"] == 0.5
    system.host.refuse = ""
    assert system.adapt(SetParameters("listener", {"gain": 0.1})).outcome is Outcome.APPLIED


def test_a_failing_activation_of_a_working_component_is_undone_by_way_of_unconfigured(system: System) -> None:
    assert system.adapt(ChangeState("fragile", Transition.DEACTIVATE)).outcome is Outcome.APPLIED
    report = system.adapt(
        Connect("fragile", "heard", "others"),
        SetParameters("fragile", {"mood": "fails"}),
        ChangeState("fragile", Transition.ACTIVATE),
    )
    assert report.outcome is Outcome.ROLLED_BACK, report
    view = system.view("fragile")
    assert (view.state, view.connections["heard"]) == (State.INACTIVE, "numbers")
    assert view.parameters["mood"] == "well"


def test_a_new_source_that_hangs_leaves_the_input_on_its_topic(impatient: System) -> None:
    system = impatient
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    # "other" never answers: its thread waits in a handler that nobody releases before the end of the test.
    gate = Fragile.release
    system.running["other"].runtime.post(lambda: gate.wait(PATIENCE))
    report = system.adapt(Connect("listener", "heard", "others"))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "other" in report.error
    assert system.view("listener").connections["heard"] == "numbers"
    heard = len(system.running["listener"].component.log)
    wait_until(lambda: len(system.running["listener"].component.log) > heard)


def test_a_component_restarted_with_the_new_values_counts_as_applied_to(system: System) -> None:
    system.adapt(SetParameters("listener", {"gain": 0.9}))
    restarted = system.restart("listener")
    assert restarted.runtime.assignment.revision == 2
    assert system.view("listener").parameters["gain"] == 0.9
    assert system.adapt(SetParameters("listener", {"gain": 0.8})).outcome is Outcome.APPLIED
    assert system.host.specs["listener"].parameters["gain"] == 0.8
    assert system.host.processes["listener"].state is ProcessState.RUNNING
