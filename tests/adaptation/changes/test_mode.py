"""Modes: named sets of changes, entered as one adaptation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.execution.perform import perform
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus_schema.model.adaptation import ChangeState, EnterMode, Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.system import System, small_architecture
from tests.support.waiting import wait_until

QUIET = [
    {"change": "set_parameters", "component": "talker", "parameters": {"rate": 10.0}},
    {"change": "connect", "component": "listener", "port": "heard", "topic": "others"},
    {"change": "remove", "component": "fragile"},
    {"change": "add", "component": "third", "spec": {"class": "tests.adaptation.parts:Listener"}},
]
WATCHFUL = [
    {"change": "transition", "component": "scanner", "transition": "activate"},
    {"change": "transition", "component": "fragile", "transition": "cleanup"},
]
BROKEN = [{"change": "set_parameters", "component": "talker", "parameters": {"rate": -1.0}}]


@pytest.fixture
def modal(bare_system: System) -> System:
    """A system whose stack has modes."""
    modes = {"watchful": WATCHFUL, "quiet": QUIET, "broken": BROKEN, "nested": [{"change": "mode", "mode": "quiet"}]}
    bare_system.host.architecture = replace(small_architecture(), modes=modes)
    bare_system.start_manager()
    return bare_system


def test_a_mode_is_entered_as_one_adaptation_and_left_by_undoing_it(modal: System) -> None:
    before, specs = modal.views(), dict(modal.host.specs)
    report = modal.adapt(EnterMode("quiet"))
    assert report.outcome is Outcome.APPLIED, report
    assert report.request.changes == (EnterMode("quiet"),)
    assert modal.view("talker").parameters["rate"] == 10.0
    assert modal.view("listener").connections["heard"] == "others"
    assert modal.view("third").state is State.ACTIVE
    assert "fragile" not in modal.host.processes
    undone = modal.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert {name: spec.state for name, spec in modal.host.specs.items()} == {n: s.state for n, s in specs.items()}
    after = modal.views()
    assert {n: view[1:] for n, view in after.items()} == {n: view[1:] for n, view in before.items()}


def test_an_undo_is_refused_if_what_the_mode_set_was_changed_since(modal: System) -> None:
    report = modal.adapt(EnterMode("quiet"))
    modal.adapt(SetParameters("talker", {"rate": 20.0}))
    undone = modal.undo(report.id)
    assert undone.outcome is Outcome.REJECTED
    assert "adaptation 3" in undone.violations[0].problem


def test_an_undo_is_refused_with_the_mode_that_changed_a_state_since(modal: System) -> None:
    report = modal.adapt(ChangeState("scanner", Transition.CLEANUP))
    assert modal.adapt(EnterMode("watchful")).outcome is Outcome.APPLIED
    undone = modal.undo(report.id)
    assert undone.outcome is Outcome.REJECTED
    assert "adaptation 3" in undone.violations[0].problem


def test_a_mode_says_which_states_are_to_be_reached_from_whichever_there_are(modal: System) -> None:
    first = modal.adapt(EnterMode("watchful"))
    assert first.outcome is Outcome.APPLIED, first
    assert modal.view("scanner").state is State.ACTIVE
    assert modal.view("fragile").state is State.UNCONFIGURED
    again = modal.adapt(EnterMode("watchful"))
    assert (again.outcome, again.steps) == (Outcome.APPLIED, ())
    modal.adapt(ChangeState("scanner", Transition.DEACTIVATE))
    assert modal.adapt(EnterMode("watchful")).outcome is Outcome.APPLIED
    assert modal.view("scanner").state is State.ACTIVE


@pytest.mark.parametrize(
    ("mode", "field", "text"),
    [
        ("quite", "mode", "there is no mode 'quite'; did you mean 'quiet'?"),
        ("broken", "parameters.rate", "at least 0.0"),
        ("nested", "mode", "enters another mode"),
    ],
)
def test_a_mode_that_cannot_be_entered_is_rejected_under_its_index(
    modal: System, mode: str, field: str, text: str
) -> None:
    before = modal.views()
    report = modal.adapt(SetParameters("listener", {"gain": 0.1}), EnterMode(mode))
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert (violation.change, violation.field) == (1, field)
    assert text in violation.problem
    assert modal.views() == before


def _by_itself(system: System, name: str, transition: Transition) -> None:
    """Have a component be in another state than its architecture says."""
    runtime = system.running[name].runtime
    before = runtime.state
    runtime.post(lambda: runtime.lifecycle.perform(transition))
    wait_until(lambda: runtime.state is not before)


def test_the_architecture_follows_what_is_as_a_mode_wants_it_already(modal: System) -> None:
    _by_itself(modal, "scanner", Transition.ACTIVATE)
    states = [modal.host.specs["scanner"].state]
    report = modal.adapt(EnterMode("watchful"))
    states.append(modal.host.specs["scanner"].state)
    assert (report.outcome, [step.component for step in report.steps]) == (Outcome.APPLIED, ["fragile", "fragile"])
    assert states == [State.INACTIVE, State.ACTIVE]
    assert modal.view("scanner").state is State.ACTIVE


def test_a_run_that_began_by_an_earlier_spec_meanwhile_undoes_the_mode_and_it_can_be_entered_again(
    modal: System, monkeypatch: pytest.MonkeyPatch
) -> None:
    _by_itself(modal, "fragile", Transition.DEACTIVATE)
    _by_itself(modal, "fragile", Transition.CLEANUP)

    async def perform_and_restart(site: ExecutionContext, action: Any, *more: Any) -> None:
        await perform(site, action, *more)
        if modal.running["fragile"].runtime.assignment.incarnation == 1:
            modal.restart("fragile")

    monkeypatch.setattr(transaction, "perform", perform_and_restart)
    report = modal.adapt(EnterMode("watchful"))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "fragile: state is 'active', should be 'unconfigured'" in report.error
    assert modal.adapt(EnterMode("watchful")).outcome is Outcome.APPLIED
    assert modal.view("fragile").state is State.UNCONFIGURED
