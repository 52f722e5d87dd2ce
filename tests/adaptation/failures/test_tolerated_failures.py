"""A broken component does not keep an adaptation from doing without it."""

from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    EnterMode,
    Outcome,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.system import System, small_architecture
from tests.support.waiting import PATIENCE, wait_until

WITHOUT = [
    {"change": "transition", "component": "fragile", "transition": "deactivate"},
    {"change": "set_parameters", "component": "listener", "parameters": {"gain": 0.1}},
]
WITH = [{"change": "transition", "component": "fragile", "transition": "activate"}]
BARE = [{"change": "transition", "component": "fragile", "transition": "cleanup"}]
DOWN = ChangeState("fragile", Transition.DEACTIVATE)
LAME = Add("lame", ComponentSpec(cls="tests.adaptation.parts:Newcomer", parameters={"where": "activate"}))
"""A change that fails at its last step."""


@pytest.fixture
def modal(bare_system: System) -> System:
    """A system with modes that do without a part, and with it."""
    modes = {"without": WITHOUT, "with": WITH, "bare": BARE}
    bare_system.host.architecture = replace(small_architecture(), modes=modes)
    bare_system.ends_are_seen = True
    bare_system.start_manager(answer_within=0.4, undo_within=0.6)
    return bare_system


def _mood(system: System, mood: str) -> None:
    assert system.adapt(SetParameters("fragile", {"mood": mood})).outcome is Outcome.APPLIED


def _fail(system: System) -> None:
    """Have the part fail: it should be active, and is unconfigured."""
    fragile = system.running["fragile"]
    fragile.runtime.post(lambda: fragile.component.kit.fail("it is broken"))
    wait_until(lambda: system.view("fragile").state is State.UNCONFIGURED)


def _quarantine(system: System, name: str = "fragile") -> None:
    system.running.pop(name).kill()
    system.host.ended(name, ProcessState.QUARANTINED)


def test_a_part_that_cannot_be_deactivated_is_left_where_it_failed(modal: System) -> None:
    _mood(modal, "clings")
    report = modal.adapt(EnterMode("without"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.view("fragile").state is State.UNCONFIGURED
    assert modal.host.specs["fragile"].state is State.INACTIVE
    assert modal.view("listener").parameters["gain"] == 0.1
    wait_until(lambda: any(event.kind == "adaptation.failure_tolerated" for event in modal.events))
    (event,) = [event for event in modal.events if event.kind == "adaptation.failure_tolerated"]
    assert event.details == {"component": "fragile", "code": "failed_on_its_way_down"}
    assert "cannot be deactivated in this mood" in event.text


def test_a_part_that_cannot_even_recover_ends_and_the_adaptation_holds(modal: System) -> None:
    _mood(modal, "drowns")
    report = modal.adapt(EnterMode("without"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.host.processes["fragile"].state is ProcessState.STOPPED
    assert modal.host.specs["fragile"].state is State.INACTIVE


def test_a_part_that_cannot_be_deactivated_is_removed(modal: System) -> None:
    _mood(modal, "clings")
    report = modal.adapt(Remove("fragile"))
    assert report.outcome is Outcome.APPLIED, report
    assert "fragile" not in modal.host.processes


def test_what_failed_on_the_way_is_brought_back_when_the_rest_cannot_be_done(modal: System) -> None:
    _mood(modal, "clings")
    before = modal.views()
    report = modal.adapt(DOWN, LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert modal.views() == before
    _mood(modal, "well")


@pytest.mark.parametrize("change", [DOWN, EnterMode("without"), Remove("fragile"), EnterMode("bare")])
def test_a_quarantined_part_keeps_nobody_from_doing_without_it(modal: System, change: Change) -> None:
    _quarantine(modal)
    report = modal.adapt(change, Connect("listener", "heard", "others"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.view("listener").connections["heard"] == "others"
    if change != Remove("fragile"):
        assert modal.host.processes["fragile"].state is ProcessState.QUARANTINED
        assert modal.host.specs["fragile"].state is not State.ACTIVE
    else:
        assert "fragile" not in modal.host.processes


def test_a_quarantined_part_that_is_needed_active_is_named(modal: System) -> None:
    assert modal.adapt(DOWN).outcome is Outcome.APPLIED
    _quarantine(modal)
    report = modal.adapt(EnterMode("with"))
    assert report.outcome is Outcome.REJECTED
    assert [(one.component, one.field) for one in report.violations] == [("fragile", "status")]


def test_a_writer_in_quarantine_is_removed_although_its_reader_needs_it(modal: System) -> None:
    _quarantine(modal, "talker")
    report = modal.adapt(ChangeState("talker", Transition.DEACTIVATE))
    assert report.outcome is Outcome.APPLIED, report
    report = modal.adapt(Remove("talker"))
    assert report.outcome is Outcome.APPLIED, report


def test_a_quarantined_part_is_told_its_connections_and_values_for_when_it_is_started(modal: System) -> None:
    assert modal.adapt(DOWN).outcome is Outcome.APPLIED
    _quarantine(modal)
    report = modal.adapt(Connect("fragile", "heard", "others"), SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.APPLIED, report
    spec = modal.host.specs["fragile"]
    assert (spec.connections["heard"], spec.parameters["level"]) == ("others", 3)


def test_a_hung_part_that_is_not_needed_is_ended(modal: System) -> None:
    gate = threading.Event()
    fragile = modal.running["fragile"]
    fragile.runtime.post(lambda: gate.wait(PATIENCE))

    def kill(name: str) -> None:
        gate.set()
        modal.running.pop(name).kill()

    modal.host.terminate = kill
    report = modal.adapt(EnterMode("without"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.host.processes["fragile"].state is ProcessState.STOPPED
    assert modal.host.specs["fragile"].state is State.INACTIVE
    wait_until(lambda: any(event.details.get("code") == "does_not_answer" for event in modal.events))


def test_a_failed_part_is_left_alone_by_a_mode_that_wants_it_inactive(modal: System) -> None:
    _fail(modal)
    report = modal.adapt(EnterMode("without"))
    assert report.outcome is Outcome.APPLIED, report
    assert [step.component for step in report.steps] == ["listener"]
    assert modal.view("fragile").state is State.UNCONFIGURED
    assert modal.host.specs["fragile"].state is State.INACTIVE


def test_an_undo_never_activates_what_had_failed_before(modal: System) -> None:
    _fail(modal)
    for changes in ((EnterMode("without"), LAME), (Remove("fragile"), LAME), (DOWN, LAME)):
        report = modal.adapt(*changes)
        assert report.outcome is Outcome.ROLLED_BACK, report
        assert modal.view("fragile").state is State.UNCONFIGURED
        assert modal.host.specs["fragile"].state is State.ACTIVE
        assert modal.view("listener").parameters["gain"] == 0.5


def test_an_undo_leaves_a_quarantined_part_in_quarantine(modal: System) -> None:
    _quarantine(modal)
    report = modal.adapt(EnterMode("without"), LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert modal.host.processes["fragile"].state is ProcessState.QUARANTINED
    assert modal.host.specs["fragile"].state is State.ACTIVE


def test_an_undo_does_not_start_a_hung_part_that_was_ended(modal: System) -> None:
    gate = threading.Event()
    modal.running["fragile"].runtime.post(lambda: gate.wait(PATIENCE))

    def kill(name: str) -> None:
        gate.set()
        modal.running.pop(name).kill()

    modal.host.terminate = kill
    report = modal.adapt(EnterMode("without"), LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert modal.host.processes["fragile"].state is ProcessState.STOPPED


def test_a_mode_that_wants_a_failed_part_active_brings_it_back(modal: System) -> None:
    _fail(modal)
    report = modal.adapt(EnterMode("with"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.view("fragile").state is State.ACTIVE


def test_undoing_a_mode_activates_what_failed_as_it_was_entered(modal: System) -> None:
    _mood(modal, "clings")
    entered = modal.adapt(EnterMode("without"))
    assert modal.view("fragile").state is State.UNCONFIGURED
    undone = modal.undo(entered.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert modal.view("fragile").state is State.ACTIVE
    _mood(modal, "well")


def test_a_failed_part_does_not_keep_a_mode_from_being_confirmed(modal: System) -> None:
    _mood(modal, "clings")
    report = modal.adapt(EnterMode("without"), confirm=0.3)
    assert report.outcome is Outcome.APPLIED, report
    assert modal.view("fragile").state is State.UNCONFIGURED


def test_a_part_is_connected_to_a_topic_whose_hung_reader_is_not_needed(modal: System) -> None:
    gate = threading.Event()
    modal.running["second"].runtime.post(lambda: gate.wait(PATIENCE))

    def kill(name: str) -> None:
        gate.set()
        modal.running.pop(name).kill()

    modal.host.terminate = kill
    report = modal.adapt(ChangeState("second", Transition.DEACTIVATE), Connect("listener", "heard", "others"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.view("listener").connections["heard"] == "others"


@pytest.mark.parametrize("mood", ["clings", "drowns"])
def test_a_part_that_cannot_be_deactivated_is_no_reason_to_be_stuck_when_it_was_not_active_before(
    modal: System, mood: str
) -> None:
    assert modal.adapt(DOWN).outcome is Outcome.APPLIED
    _mood(modal, mood)
    report = modal.adapt(ChangeState("fragile", Transition.ACTIVATE), LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert modal.host.specs["fragile"].state is State.INACTIVE
    assert mood == "drowns" or modal.view("fragile").state is State.UNCONFIGURED


def test_a_failed_part_is_swapped_for_another_class(modal: System) -> None:
    _fail(modal)
    report = modal.adapt(Swap("fragile", "tests.adaptation.parts:Listener"))
    assert report.outcome is Outcome.APPLIED, report
    assert modal.view("fragile").state is State.ACTIVE
    assert modal.host.specs["fragile"].cls == "tests.adaptation.parts:Listener"


def test_a_swap_of_a_failed_part_that_cannot_be_done_leaves_it_failed(modal: System) -> None:
    _fail(modal)
    report = modal.adapt(Swap("fragile", "tests.adaptation.parts:Listener"), LAME)
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert modal.host.specs["fragile"].cls == "tests.adaptation.parts:Fragile"
    assert modal.view("fragile").state is not State.ACTIVE
