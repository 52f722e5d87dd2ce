"""What is wrong is found before anything moves, and all of it is said."""

from __future__ import annotations

import pytest

from regraft.bus_schema.encoding.shapes import CUT
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Add,
    ChangeState,
    Connect,
    Outcome,
    SetParameters,
    StepState,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import Transition
from tests.adaptation.system import System


def _fields(report: AdaptationReport) -> set[tuple[int | None, str, str]]:
    assert report.outcome is Outcome.REJECTED, report
    return {(v.change, v.component, v.field) for v in report.violations}


def test_a_rejected_adaptation_touches_nothing(system: System) -> None:
    before, updates = system.views(), len(system.host.updates)
    report = system.adapt(SetParameters("listener", {"gain": 0.9}), SetParameters("talker", {"rate": -1.0}))
    assert report.outcome is Outcome.REJECTED
    assert (report.revision_before, report.revision_after) == (1, 1)
    assert system.views() == before
    assert system.view("listener").revision == 1
    assert len(system.host.updates) == updates


def test_every_violation_is_reported(system: System) -> None:
    report = system.adapt(
        SetParameters("listener", {"gain": 7.0, "label": "ugly", "volume": 1, "fixed": 2}),
        SetParameters("nobody", {"gain": 0.1}),
        Connect("listener", "heard", "nowhere"),
        ChangeState("listener", Transition.CONFIGURE),
        SetParameters("listener", {"gain": 0.2}),
        revision=17,
    )
    assert _fields(report) >= {
        (None, "", "revision"),
        (0, "listener", "parameters.label"),
        (0, "listener", "parameters.volume"),
        (0, "listener", "parameters.fixed"),
        (1, "nobody", "component"),
        (2, "listener", "connect.heard"),
        (3, "listener", "transition"),
        (4, "listener", "parameters.gain"),
    }


def test_a_stale_revision_is_refused(system: System) -> None:
    assert system.adapt(SetParameters("listener", {"gain": 0.1}), revision=1).outcome is Outcome.APPLIED
    report = system.adapt(SetParameters("listener", {"gain": 0.2}), revision=1)
    assert _fields(report) == {(None, "", "revision")}
    assert "the architecture is at revision 2" in report.violations[0].problem
    assert system.view("listener").parameters["gain"] == 0.1


def test_a_component_that_does_not_run_is_named(system: System) -> None:
    system.running["talker"].kill()
    system.host.ended("talker", ProcessState.QUARANTINED)
    report = system.adapt(SetParameters("talker", {"rate": 10.0}))
    assert _fields(report) == {(0, "talker", "status")}
    assert "quarantined" in report.violations[0].problem


def test_a_component_that_hangs_already_is_named(impatient: System) -> None:
    system = impatient
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    assert system.adapt(SetParameters("fragile", {"level": 1})).outcome is Outcome.ROLLED_BACK
    report = system.adapt(SetParameters("fragile", {"mood": "well"}))
    assert _fields(report) == {(0, "fragile", "status")}
    assert "no answer within 0.4 s" in report.violations[0].problem


def test_an_empty_adaptation_is_rejected(system: System) -> None:
    assert _fields(system.adapt()) == {(None, "", "changes")}


def test_a_dry_run_shows_the_plan_and_the_architecture_and_touches_nothing(system: System) -> None:
    before = system.views()
    report = system.adapt(
        Connect("listener", "heard", "others"), SetParameters("listener", {"gain": 0.1}), dry_run=True
    )
    assert report.outcome is Outcome.PENDING
    assert [(step.component, step.state) for step in report.steps] == [("listener", StepState.PLANNED)] * 2
    assert report.architecture is not None
    assert report.architecture.revision == 2
    assert report.architecture.components["listener"].connections["heard"] == "others"
    assert system.views() == before
    assert len(system.lines().entries) == 1


def test_a_host_that_does_not_answer_is_named(impatient: System) -> None:
    system = impatient
    system.adapt(SetParameters("listener", {"gain": 0.1}))
    system.host.close()
    report = system.adapt(SetParameters("listener", {"gain": 0.2}))
    assert _fields(report) == {(0, "listener", "status")}
    assert "its host 'local' does not answer" in report.violations[0].problem


def test_parameters_that_would_swell_the_journal_are_refused_with_their_limit() -> None:
    for change in (
        SetParameters("listener", {"note": "x" * 900_000}),
        SetParameters("listener", {"x" * 900_000: 1}),
        Swap("listener", "", {"notes": ["x" * 60_000] * 9}),
        Add("other", ComponentSpec(parameters={"note": {"deep": ["x" * 900_000]}})),
    ):
        with pytest.raises(BadMessage, match=r"^changes\.1\.parameters: has the size \d+, must be at most 500000$"):
            AdaptationRequest((SetParameters("listener", {}), change))


def test_what_quotes_a_long_text_is_told_all_the_same(system: System) -> None:
    long = "x" * 400_000
    applied = system.adapt(SetParameters("listener", {"note": long}))
    assert not applied.violations, applied.violations[0].problem[:2000]
    assert (applied.outcome, system.view("listener").parameters["note"]) == (Outcome.APPLIED, long)
    assert system.lines().entries[0].steps[0].action.endswith(CUT)
    for change in (SetParameters("listener", {long: 1}), SetParameters("x" * 60_000, {long: 1})):
        report = system.adapt(change)
        assert report.outcome is Outcome.REJECTED
        assert max(len(violation.problem) for violation in report.violations) <= 4096
