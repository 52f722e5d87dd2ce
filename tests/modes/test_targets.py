"""Targets and actual modes: asked for, inferred, undone, reachable."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, PartModes, SystemModes
from regraft.bus_schema.model.adaptation import ChangeState, EnterMode, Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import Transition
from tests.adaptation.system import System, small_architecture, started
from tests.support.waiting import PATIENCE

FAST = [{"change": "set_parameters", "component": "talker", "parameters": {"rate": 40.0}}]
SLOW = [{"change": "set_parameters", "component": "talker", "parameters": {"rate": 10.0}}]
ASLEEP = [
    {"change": "transition", "component": name, "transition": "deactivate"} for name in ("scanner", "fragile", "second")
]
BROKEN = [{"change": "set_parameters", "component": "talker", "parameters": {"rate": -1.0}}]
STACK_MODES = {
    "talker.fast": FAST,
    "talker.slow": SLOW,
    "talker.thrifty": SLOW,
    "asleep": ASLEEP,
    "awake": [{"change": "transition", "component": "scanner", "transition": "activate"}],
    "broken": BROKEN,
    "night": [*SLOW, *ASLEEP],
}


@pytest.fixture
def modal(tmp_path: Path) -> Iterator[System]:
    """A system with modes of a component and of all."""
    parts: dict[str, tuple[str, ...]] = {"night": ("talker.slow",)}
    with started(small_architecture(), tmp_path) as system:
        system.host.architecture = replace(small_architecture(), modes=STACK_MODES, mode_parts=parts)
        system.start_manager()
        yield system


def _part(system: System, name: str, *, reachable: bool = False) -> PartModes:
    found = system.client.call(MODES, ModesRequest(reachable), SystemModes, PATIENCE)
    part = found.part(name)
    assert part is not None
    return part


def test_two_modes_with_equal_settings_are_told_apart_by_what_was_asked_for(modal: System) -> None:
    for mode in ("talker.thrifty", "talker.slow", "talker.thrifty"):
        modal.adapt(EnterMode(mode))
        part = _part(modal, "talker")
        assert (part.target, part.actual) == (mode, mode)
        assert [each.mode for each in part.modes if each.fits] == ["talker.slow", "talker.thrifty"]


def test_an_undo_asks_for_the_previous_mode_again(modal: System) -> None:
    modal.adapt(EnterMode("talker.fast"))
    entered = modal.adapt(EnterMode("talker.slow"))
    assert modal.undo(entered.id).outcome is Outcome.APPLIED
    part = _part(modal, "talker")
    assert (part.target, part.actual, part.as_asked) == ("talker.fast", "talker.fast", True)


def test_a_mode_that_enters_another_asks_for_it_too(modal: System) -> None:
    modal.adapt(EnterMode("night"))
    assert _part(modal, "").target == "night"
    assert _part(modal, "talker").target == "talker.slow"


def test_a_value_that_was_changed_since_is_seen_and_the_target_stays(modal: System) -> None:
    modal.adapt(EnterMode("talker.slow"))
    modal.adapt(SetParameters("talker", {"rate": 11.0}))
    part = _part(modal, "talker")
    assert (part.target, part.actual, part.as_asked) == ("talker.slow", "", False)


def test_a_mode_in_which_all_is_inactive_is_one_like_any_other(modal: System) -> None:
    modal.adapt(EnterMode("asleep"))
    part = _part(modal, "")
    assert (part.target, part.actual, part.state) == ("asleep", "asleep", "active")
    assert modal.adapt(EnterMode("asleep")).outcome is Outcome.APPLIED


def test_values_are_exactly_as_before_after_a_while_of_being_inactive(modal: System) -> None:
    modal.adapt(EnterMode("talker.slow"))
    before = modal.view("talker").parameters
    modal.adapt(ChangeState("talker", Transition.DEACTIVATE))
    modal.adapt(ChangeState("talker", Transition.ACTIVATE))
    assert modal.view("talker").parameters == before
    assert _part(modal, "talker").actual == "talker.slow"


def test_what_is_reachable_is_told_whatever_the_number_of_transitions_and_why_not(modal: System) -> None:
    modal.adapt(ChangeState("scanner", Transition.CLEANUP))
    modes = {each.mode: each for each in _part(modal, "", reachable=True).modes}
    assert modes["awake"].reachable
    assert not modes["broken"].reachable
    assert "talker.parameters.rate" in modes["broken"].problem
    assert modal.adapt(EnterMode("awake")).outcome is Outcome.APPLIED
    assert _part(modal, "").actual == "awake"


def test_a_part_without_a_run_is_in_the_modes_that_do_without_it_only(modal: System) -> None:
    modal.adapt(EnterMode("talker.slow"))
    modal.running["talker"].kill()
    modal.host.ended("talker")
    part = _part(modal, "talker")
    assert (part.target, part.actual, part.state) == ("talker.slow", "", "unknown")
    assert "talker" in part.failure
