"""Undoing an applied adaptation."""

from __future__ import annotations

import pytest

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.model.adaptation import ChangeState, Connect, Outcome, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.parts import Fragile
from tests.adaptation.system import System


def test_undo_leads_back_to_where_it_was(system: System) -> None:
    before = system.views()
    done = system.adapt(
        SetParameters("listener", {"gain": 0.9, "label": "fancy"}),
        Connect("listener", "heard", "others"),
        ChangeState("fragile", Transition.DEACTIVATE),
        ChangeState("fragile", Transition.CLEANUP),
    )
    assert done.outcome is Outcome.APPLIED, done
    assert system.view("fragile").state is State.UNCONFIGURED
    undone = system.undo(done.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert undone.request.undoes == done.id
    assert system.views() == before
    assert undone.revision_after == 3


def test_a_dry_run_of_an_undo_gives_its_plan_and_result_and_touches_nothing(system: System) -> None:
    done = system.adapt(
        SetParameters("listener", {"gain": 0.9}),
        Connect("listener", "heard", "others"),
        ChangeState("fragile", Transition.DEACTIVATE),
    )
    before, lines = system.views(), system.lines()
    tried = system.undo(done.id, dry_run=True)
    assert tried.request.dry_run
    assert tried.request.undoes == done.id
    assert system.views() == before
    assert system.lines() == lines
    assert tried.estimate is not None
    undone = system.undo(done.id)
    assert undone.outcome is Outcome.APPLIED
    assert undone.id == str(int(done.id) + 1)
    assert [step.action for step in tried.steps] == [step.action for step in undone.steps]
    assert tried.request.changes == undone.request.changes
    now = system.client.call("adaptation_manager/architecture", ArchitectureRequest(), Architecture)
    assert tried.architecture == now


def test_a_dry_run_of_an_undo_that_cannot_be_says_so_without_a_line(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9}))
    system.adapt(SetParameters("listener", {"gain": 0.8}))
    lines = system.lines()
    tried = system.undo(done.id, dry_run=True)
    assert tried.outcome is Outcome.REJECTED
    assert tried.violations[0].field == "parameters.gain"
    assert system.lines() == lines
    with pytest.raises(CallFailed, match="no ended adaptation"):
        system.undo("99", dry_run=True)


def test_an_undo_can_be_undone(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9}))
    undone = system.undo(done.id)
    assert system.undo(undone.id).outcome is Outcome.APPLIED
    assert system.view("listener").parameters["gain"] == 0.9


def test_undo_is_rejected_when_a_later_adaptation_decided_otherwise(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9, "label": "fancy"}))
    later = system.adapt(SetParameters("listener", {"gain": 0.8}))
    undone = system.undo(done.id)
    assert undone.outcome is Outcome.REJECTED
    (violation,) = undone.violations
    assert violation.field == "parameters.gain"
    assert f"adaptation {later.id}" in violation.problem
    assert system.undo(later.id).outcome is Outcome.APPLIED
    assert system.undo(done.id).outcome is Outcome.APPLIED
    assert system.view("listener").parameters["label"] == "plain"


def test_a_second_undo_is_refused_by_the_first_one_and_what_leads_back(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9, "label": "fancy"}))
    undo = system.undo(done.id)
    again = system.undo(done.id)
    (violation,) = again.violations
    assert (again.outcome, violation.field) == (Outcome.REJECTED, "undoes")
    assert f"is undone already, by adaptation {undo.id}; undo {undo.id} to have it again" in violation.problem
    redone = system.undo(undo.id)
    assert redone.outcome is Outcome.APPLIED
    later = system.adapt(SetParameters("listener", {"gain": 0.8}))
    (violation,) = system.undo(done.id).violations
    assert f"adaptation {later.id}" in violation.problem
    assert violation.field == "parameters.gain"


def test_only_an_applied_adaptation_can_be_undone(system: System) -> None:
    rejected = system.adapt(SetParameters("listener", {"gain": 7.0}))
    undone = system.undo(rejected.id)
    assert undone.outcome is Outcome.REJECTED
    assert "only an applied one can be undone" in undone.violations[0].problem
    with pytest.raises(CallFailed, match="changed nothing"):
        system.undo("1")
    with pytest.raises(CallFailed, match="no ended adaptation"):
        system.undo("99")


def test_the_same_key_is_the_same_undo_across_a_restart_of_the_manager(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9}))
    undone = system.undo(done.id, key="k1")
    assert undone.outcome is Outcome.APPLIED, undone
    assert system.undo(done.id, key="k1", wait=False) == undone
    system.running["manager"].kill()
    system.start_manager()
    assert system.undo(done.id, key="k1") == undone
    assert system.undo(done.id).outcome is Outcome.REJECTED


def test_the_key_of_another_request_undoes_nothing(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9}), key="k1")
    later = system.adapt(SetParameters("talker", {"rate": 10.0}))
    assert system.undo(later.id, key="k2").outcome is Outcome.APPLIED
    for adaptation, key, reason in ((done.id, "k1", ""), (done.id, "k2", ""), (later.id, "k2", "another")):
        with pytest.raises(CallFailed) as refused:
            system.undo(adaptation, key=key, reason=reason)
        assert refused.value.code is RefusalCode.KEY_REUSED
    assert system.view("listener").parameters["gain"] == 0.9


def test_an_undo_of_an_earlier_revision_is_refused_for_it_first(system: System) -> None:
    done = system.adapt(SetParameters("listener", {"gain": 0.9}))
    system.adapt(SetParameters("listener", {"gain": 0.8}))
    stale = system.undo(done.id, revision=2)
    assert stale.outcome is Outcome.REJECTED
    assert [violation.field for violation in stale.violations] == ["revision", "parameters.gain"]
    assert [violation.field for violation in system.undo(done.id, revision=3).violations] == ["parameters.gain"]


def test_an_undo_that_none_waits_for_is_answered_at_once_and_carried_out(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=5.0)
    done = system.adapt(SetParameters("listener", {"gain": 0.9}))
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    system.adapt(SetParameters("fragile", {"level": 1}), wait=False)
    pending = system.undo(done.id, key="k1", wait=False)
    assert pending.outcome is Outcome.PENDING
    assert system.undo(done.id, key="k1", wait=False).id == pending.id
    Fragile.release.set()
    assert system.undo(done.id, key="k1").id == pending.id
    assert system.lines(id=pending.id).entries[0].outcome is Outcome.APPLIED
