"""An adaptation that is to be confirmed is watched for a while, and undone if it does not hold."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest

from regraft import CallFailed
from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.bus_schema.messages.management.manager import ArchitectureRequest, ConfirmAdaptation
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    Add,
    ChangeState,
    Connect,
    Outcome,
    Phase,
    Remove,
    SetParameters,
    StepState,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.parts import Fragile
from tests.adaptation.system import System
from tests.adaptation.watching.conftest import Looks
from tests.support.waiting import PATIENCE, wait_until

LOUDER = SetParameters("listener", {"gain": 0.9})
LONG = 60.0
SHORT = 0.4


def _architecture(system: System) -> Architecture:
    return system.client.call("adaptation_manager/architecture", ArchitectureRequest(), Architecture)


def _confirm(system: System, adaptation: str) -> AdaptationReport:
    return system.client.call("adaptation_manager/confirm", ConfirmAdaptation(adaptation), AdaptationReport, PATIENCE)


def _line(system: System, adaptation: str) -> AdaptationReport:
    return system.lines(id=adaptation).entries[0]


def _confirming(system: System, *changes: object, **more: object) -> AdaptationReport:
    """Begin an adaptation, and return its line once it only has to be confirmed."""
    pending = system.adapt(*changes, wait=False, **{"confirm": LONG, **more})  # type: ignore[arg-type]
    wait_until(lambda: _line(system, pending.id).outcome is not Outcome.PENDING)
    line = _line(system, pending.id)
    assert line.outcome is Outcome.CONFIRMING, line
    return line


def _ended(system: System, adaptation: str) -> AdaptationReport:
    wait_until(lambda: _line(system, adaptation).outcome is not Outcome.CONFIRMING)
    return _line(system, adaptation)


def _tell(system: System, satisfied: bool | None, *, active: bool = True, requirement: str = "MoveSafely") -> None:
    """Have a component tell how a quality requirement is met."""
    told = threading.Event()
    runtime = system.running["scanner"].runtime
    quality = Quality(1.0, requirement, "Safety", metric=0.25, satisfied=satisfied, active=active)

    def tell() -> None:
        runtime.component.kit.report_quality(quality)
        told.set()

    runtime.post(tell)
    assert told.wait(PATIENCE)


def _see(looks: Looks) -> None:
    """Wait for a look that sees what was reported."""
    asked = looks.count
    wait_until(lambda: looks.count > asked + 1)


def test_what_holds_for_its_time_is_applied(system: System) -> None:
    report = system.adapt(LOUDER, confirm=SHORT)
    assert (report.outcome, report.revision_after) == (Outcome.APPLIED, 2)
    assert [phase.phase for phase in report.phases] == [Phase.CHECK, Phase.COMMIT, Phase.VERIFY, Phase.CONFIRM]
    assert report.phases[-1].duration >= SHORT
    assert system.view("listener").parameters["gain"] == 0.9
    assert _line(system, report.id) == report


def test_until_then_it_is_in_force_and_said_not_to_be_final(system: System) -> None:
    line = _confirming(system, LOUDER)
    assert (line.revision_before, line.revision_after) == (1, 2)
    assert [step.state for step in line.steps] == [StepState.DONE]
    now = _architecture(system)
    assert (now.revision, now.unconfirmed) == (2, line.id)
    assert now.components["listener"].parameters["gain"] == 0.9
    assert system.view("listener").revision == 2
    assert system.host.specs["listener"].parameters["gain"] == 0.9
    ended = _confirm(system, line.id)
    assert ended.outcome is Outcome.APPLIED
    assert (_architecture(system).revision, _architecture(system).unconfirmed) == (2, "")


def test_others_wait_until_it_is_final(system: System) -> None:
    line = _confirming(system, LOUDER)
    other = system.adapt(SetParameters("second", {"gain": 0.2}), wait=False)
    stale = system.adapt(SetParameters("second", {"gain": 0.3}), wait=False, revision=1)
    assert _line(system, other.id).outcome is Outcome.PENDING
    assert system.view("second").parameters["gain"] == 0.5
    _confirm(system, line.id)
    last = system.adapt(SetParameters("second", {"gain": 0.4}))
    assert (_line(system, other.id).outcome, last.revision_after) == (Outcome.APPLIED, 4)
    assert _line(system, stale.id).outcome is Outcome.REJECTED


def _dies(system: System) -> None:
    system.running["listener"].kill()
    system.host.ended("listener")


def _restarts(system: System) -> None:
    system.restart("listener")


def _reports_an_error(system: System) -> None:
    runtime = system.running["listener"].runtime
    runtime.post(lambda: runtime.guarded("hear", lambda: 1 / 0))


def _leaves_its_state(system: System) -> None:
    runtime = system.running["listener"].runtime
    runtime.post(lambda: runtime.lifecycle.perform(Transition.DEACTIVATE))


@pytest.mark.parametrize(
    ("break_it", "why"),
    [
        (_dies, "listener has ended: killed"),
        (_restarts, "listener was restarted"),
        (_reports_an_error, "listener reported an error: hear: ZeroDivisionError"),
        (_leaves_its_state, "listener is inactive, should be active"),
    ],
)
def test_a_component_that_does_not_stay_well_undoes_it(
    system: System, looks: Looks, break_it: Callable[[System], None], why: str
) -> None:
    specs = dict(system.host.specs)
    line = _confirming(system, LOUDER, SetParameters("second", {"gain": 0.2}))
    looks.before_the_next(partial(break_it, system))
    ended = _ended(system, line.id)
    assert ended.outcome is Outcome.ROLLED_BACK, ended
    assert f"not confirmed: {why}" in ended.error
    assert system.view("second").parameters["gain"] == 0.5
    assert system.host.specs == specs
    assert (_architecture(system).revision, _architecture(system).unconfirmed) == (1, "")


def test_what_was_so_already_is_watched_too(system: System) -> None:
    system.adapt(LOUDER)
    line = _confirming(system, LOUDER)
    _dies(system)
    assert _ended(system, line.id).outcome is Outcome.ROLLED_BACK


def test_a_component_that_hangs_undoes_it(impatient: System) -> None:
    system = impatient
    gate = threading.Event()
    line = _confirming(system, LOUDER)
    system.running["listener"].runtime.post(lambda: gate.wait(PATIENCE))
    wait_until(lambda: any(event.details.get("phase") == "confirm" for event in system.events))
    gate.set()
    ended = _ended(system, line.id)
    assert ended.outcome is Outcome.ROLLED_BACK, ended
    assert "listener: reading it: no answer within 0.4 s" in ended.error
    assert system.view("listener").parameters["gain"] == 0.5


def test_errors_of_before_and_of_others_count_for_nothing(system: System) -> None:
    _reports_an_error(system)
    line = _confirming(system, LOUDER)
    other = system.running["second"].runtime
    other.post(lambda: other.guarded("hear", lambda: 1 / 0))
    wait_until(lambda: system.view("second").faults)
    assert _confirm(system, line.id).outcome is Outcome.APPLIED


def test_a_requirement_that_breaks_undoes_it(system: System) -> None:
    _tell(system, True)
    before = system.views()
    line = _confirming(system, LOUDER, Connect("listener", "heard", "others"), watch=("MoveSafely",))
    _tell(system, None)
    _tell(system, False)
    ended = _ended(system, line.id)
    assert ended.outcome is Outcome.ROLLED_BACK
    assert ended.error == "not confirmed: the quality requirement MoveSafely broke: its metric is 0.25"
    assert [step.state for step in ended.steps] == [StepState.UNDONE] * 2
    assert system.views() == before


def test_a_requirement_that_is_not_active_is_not_judged(system: System) -> None:
    _tell(system, False, active=False)
    assert system.adapt(LOUDER, confirm=SHORT, watch=("MoveSafely",)).outcome is Outcome.APPLIED


def test_a_requirement_that_nobody_tells_of_is_a_violation(system: System) -> None:
    _tell(system, True)
    before = system.views()
    report = system.adapt(LOUDER, confirm=1.0, watch=("MoveSafely", "MoveFast", "no key/at all*"))
    assert report.outcome is Outcome.REJECTED
    assert [violation.field for violation in report.violations] == ["watch.1", "watch.2"]
    assert "no report of a quality requirement 'MoveFast'" in report.violations[0].problem
    assert system.views() == before


def test_to_watch_without_a_time_to_confirm_is_refused(system: System) -> None:
    report = system.adapt(LOUDER, watch=("MoveSafely",))
    assert (report.outcome, report.violations[0].field) == (Outcome.REJECTED, "watch")


def test_a_requirement_that_was_broken_before_has_until_the_end(system: System, looks: Looks) -> None:
    _tell(system, False)
    report = system.adapt(LOUDER, confirm=SHORT, watch=("MoveSafely",))
    assert report.outcome is Outcome.ROLLED_BACK
    assert "MoveSafely was broken before, and still is" in report.error
    looks.before_the_last(partial(_tell, system, True))
    assert system.adapt(LOUDER, watch=("MoveSafely",), confirm=SHORT).outcome is Outcome.APPLIED


def test_a_requirement_that_was_broken_before_and_met_since_must_not_break_again(system: System, looks: Looks) -> None:
    _tell(system, False)
    line = _confirming(system, LOUDER, watch=("MoveSafely",))
    _tell(system, True)
    _see(looks)
    _tell(system, False)
    assert "MoveSafely broke" in _ended(system, line.id).error


def test_a_pause_of_its_task_does_not_meet_a_requirement_that_was_broken_before(system: System, looks: Looks) -> None:
    _tell(system, False)
    line = _confirming(system, LOUDER, watch=("MoveSafely",))
    for active in (False, True):
        _tell(system, False, active=active)
        _see(looks)
    _tell(system, True)
    assert _confirm(system, line.id).outcome is Outcome.APPLIED


def test_cancelling_it_undoes_it(system: System) -> None:
    before = system.views()
    line = _confirming(system, LOUDER)
    ended = system.cancel(line.id)
    assert (ended.outcome, ended.revision_after) == (Outcome.CANCELLED, 1)
    assert system.views() == before


def test_what_is_not_being_confirmed_cannot_be_confirmed(system: System) -> None:
    applied = system.adapt(LOUDER)
    assert _confirm(system, applied.id) == applied
    rejected = system.adapt(SetParameters("listener", {"gain": 7.0}))
    with pytest.raises(CallFailed, match="has ended as rejected"):
        _confirm(system, rejected.id)
    with pytest.raises(CallFailed, match="no adaptation '99'"):
        _confirm(system, "99")
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    held = system.adapt(SetParameters("fragile", {"level": 1}), wait=False)
    with pytest.raises(CallFailed, match="not being confirmed"):
        _confirm(system, held.id)
    Fragile.release.set()


def test_what_is_being_confirmed_is_cancelled_not_undone(system: System) -> None:
    line = _confirming(system, LOUDER)
    with pytest.raises(CallFailed, match="it is being confirmed; cancel it"):
        system.undo(line.id)


def test_what_was_removed_holds_still_until_it_is_final_and_is_handed_back_alive(system: System) -> None:
    process, log = system.running["second"], system.running["second"].component.log
    wait_until(lambda: len(log) > 10)
    before = system.views()
    line = _confirming(system, Remove("second"), Add("third", ComponentSpec(cls="tests.adaptation.parts:Listener")))
    assert process.thread.is_alive()
    assert system.view("second").state is State.INACTIVE
    assert "second" not in _architecture(system).components
    assert system.cancel(line.id).outcome is Outcome.CANCELLED
    assert system.running["second"] is process
    assert system.views() == before
    assert "third" not in system.host.processes
    heard = len(log)
    wait_until(lambda: len(log) > heard + 10)
    report = system.adapt(Remove("second"), confirm=SHORT)
    assert report.outcome is Outcome.APPLIED
    assert "second" not in system.host.processes


def test_a_manager_that_dies_meanwhile_undoes_it_on_its_return(system: System) -> None:
    process, before = system.running["second"], system.views()
    line = _confirming(system, LOUDER, ChangeState("fragile", Transition.DEACTIVATE), Remove("second"))
    system.running["manager"].kill()
    system.start_manager()
    ended = _line(system, line.id)
    assert ended.outcome is Outcome.ROLLED_BACK
    assert ended.error == "interrupted: the manager was restarted"
    assert system.running["second"] is process
    assert system.views() == before


def test_a_revision_that_was_undone_is_not_given_again(system: System) -> None:
    line = _confirming(system, LOUDER)
    system.cancel(line.id)
    assert system.adapt(LOUDER).revision_after == 3
    line = _confirming(system, SetParameters("listener", {"gain": 0.1}))
    assert line.revision_after == 4
    system.running["manager"].kill()
    system.start_manager()
    assert system.adapt(SetParameters("listener", {"gain": 0.2})).revision_after == 5
    system.cancel(_confirming(system, SetParameters("listener", {"gain": 0.3})).id)
    system.running["manager"].kill()
    system.start_manager()
    assert system.adapt(SetParameters("listener", {"gain": 0.4})).revision_after == 7
    assert _architecture(system).components["listener"].parameters["gain"] == 0.4


def test_a_disk_that_is_full_when_it_becomes_final_undoes_it(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    before = system.views()
    line = _confirming(system, LOUDER)

    def full(self: Journal, report: object) -> None:
        raise JournalError("database or disk is full")

    with monkeypatch.context() as patch:
        patch.setattr(Journal, "end", full)
        ended = _confirm(system, line.id)
    assert ended.outcome is Outcome.ROLLED_BACK
    assert "disk is full" in ended.error
    assert system.views() == before
    assert system.adapt(LOUDER).outcome is Outcome.APPLIED
    assert _line(system, line.id).outcome is Outcome.ROLLED_BACK


def test_every_phase_is_told_as_it_ends(system: System) -> None:
    report = system.adapt(Connect("listener", "heard", "others"), confirm=SHORT)
    wait_until(lambda: any(event.kind == "adaptation.applied" for event in system.events))
    told = [event.details.get("phase", event.kind) for event in system.events if event.kind.startswith("adaptation")]
    assert told == ["check", "commit", "verify", "adaptation.confirming", "confirm", "adaptation.applied"]
    (applied,) = [event for event in system.events if event.kind == "adaptation.applied"]
    assert applied.details["phases"] == {phase.phase.value: phase.duration for phase in report.phases}


def test_a_dry_run_says_what_it_would_watch_and_touches_nothing(system: System) -> None:
    before = system.views()
    report = system.adapt(LOUDER, confirm=LONG, dry_run=True)
    assert (report.outcome, report.violations) == (Outcome.PENDING, ())
    assert system.adapt(LOUDER, confirm=LONG, watch=("None",), dry_run=True).outcome is Outcome.REJECTED
    assert system.views() == before
    assert replace(report.request, dry_run=False).confirm == LONG
