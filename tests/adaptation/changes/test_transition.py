"""Lifecycle transitions."""

from __future__ import annotations

from regraft.adaptation_manager.manager import AdaptationManager
from regraft.bus_schema.model.adaptation import ChangeState, Connect, Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.system import System, spec_of
from tests.support.waiting import wait_until


def test_a_component_is_deactivated_and_its_spec_says_so(system: System) -> None:
    report = system.adapt(ChangeState("listener", Transition.DEACTIVATE))
    assert report.outcome is Outcome.APPLIED, report
    assert system.view("listener").state is State.INACTIVE
    assert system.host.specs["listener"].state is State.INACTIVE


def test_transitions_of_one_request_follow_each_other(system: System) -> None:
    report = system.adapt(
        ChangeState("listener", Transition.DEACTIVATE),
        ChangeState("listener", Transition.CLEANUP),
        ChangeState("listener", Transition.CONFIGURE),
        ChangeState("listener", Transition.ACTIVATE),
    )
    assert report.outcome is Outcome.APPLIED, report
    assert len(report.steps) == 4
    assert system.view("listener").state is State.ACTIVE


def test_an_illegal_transition_is_rejected_with_what_is_possible(system: System) -> None:
    report = system.adapt(ChangeState("listener", Transition.CONFIGURE))
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert (violation.change, violation.component) == (0, "listener")
    assert "configure is not possible while active; possible: deactivate" in violation.problem


def test_a_failing_activation_leads_back_to_where_it_was(system: System) -> None:
    assert system.adapt(ChangeState("fragile", Transition.DEACTIVATE)).outcome is Outcome.APPLIED
    assert system.adapt(SetParameters("fragile", {"mood": "fails"})).outcome is Outcome.APPLIED
    before = system.views()
    report = system.adapt(SetParameters("listener", {"gain": 0.1}), ChangeState("fragile", Transition.ACTIVATE))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "cannot be activated in this mood" in report.error
    assert system.views() == before


def test_a_component_configured_again_keeps_the_connections_it_was_given(system: System) -> None:
    assert system.adapt(Connect("listener", "heard", "others")).outcome is Outcome.APPLIED
    for transition in (Transition.DEACTIVATE, Transition.CLEANUP, Transition.CONFIGURE, Transition.ACTIVATE):
        assert system.adapt(ChangeState("listener", transition)).outcome is Outcome.APPLIED
    assert system.view("listener").connections["heard"] == "others"
    log = system.running["listener"].component.log
    wait_until(lambda: system.running["listener"].component.log)
    assert {source for source, _ in log} <= {"other"}


def test_connecting_an_unconfigured_component_takes_effect_when_it_is_configured(system: System) -> None:
    system.adapt(ChangeState("listener", Transition.DEACTIVATE), ChangeState("listener", Transition.CLEANUP))
    report = system.adapt(Connect("listener", "heard", "others"))
    assert (report.outcome, report.steps) == (Outcome.APPLIED, ())
    assert system.host.specs["listener"].connections["heard"] == "others"
    report = system.adapt(ChangeState("listener", Transition.CONFIGURE), ChangeState("listener", Transition.ACTIVATE))
    assert report.outcome is Outcome.APPLIED, report
    assert system.view("listener").connections["heard"] == "others"


def test_shutdown_is_refused_honestly(system: System) -> None:
    report = system.adapt(ChangeState("listener", Transition.SHUTDOWN))
    assert report.outcome is Outcome.REJECTED
    assert "not supported yet by this version" in report.violations[0].problem


def test_the_manager_does_not_change_its_own_state(bare_system: System) -> None:
    manager = spec_of("manager", AdaptationManager)
    for topic in ("adaptations", "architecture"):
        assert manager.connections[topic] == topic
    bare_system.host.specs["manager"] = manager
    bare_system.start_manager()
    bare_system.host.started("manager", 1)
    report = bare_system.adapt(ChangeState("manager", Transition.DEACTIVATE))
    assert report.outcome is Outcome.REJECTED
    assert any("its own state" in violation.problem for violation in report.violations)
