"""When a rule acts: once its condition has settled, not while a mode dwells or others have decided."""

from __future__ import annotations

from dataclasses import replace

import pytest

from regraft.adaptation_manager.planners.modes.enforcement import Enforcement, Times, entered_by
from regraft.bus_schema.messages.management.modes import PartModes, SystemModes
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Change,
    EnterMode,
    Outcome,
    SetParameters,
)
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_parts import PartKind

TIMES = Times(0.2, 1.0, 30.0, circle_window=20.0, circle_limit=3, circle_pause=60.0, retry=1.0)
DEGRADE = ModeRule("degrade", "bad", "degraded")
RECOVER = ModeRule("recover", "not bad", "normal", ("degraded",))


def _modes(target: str, *, as_asked: bool = True) -> SystemModes:
    return SystemModes(0.0, 1, (PartModes("", PartKind.SYSTEM, target, target, as_asked),))


def _begun(target: str = "normal") -> Enforcement:
    made = Enforcement()
    made.take_rules((DEGRADE, RECOVER))
    made.see(_modes(target), 0.0, TIMES)
    return made


def _due(made: Enforcement, now: float, *, bad: bool) -> str:
    made.look({"bad": bad}, now)
    rule = made.due(now, TIMES)
    return rule.mode if rule else ""


def test_a_condition_has_to_settle_and_begins_again_where_it_broke_off() -> None:
    made = _begun()
    assert [_due(made, now, bad=bad) for now, bad in ((1.0, True), (1.1, False), (1.15, True), (1.3, True))] == [""] * 4
    assert _due(made, 1.35, bad=True) == "degraded"


def test_a_condition_that_is_not_known_does_not_hold_and_says_why() -> None:
    made = _begun()
    made.look({}, 1.0)
    assert made.due(5.0, TIMES) is None
    assert [(status.holds, status.why) for status in made.status(5.0)] == [(None, "bad is not known")] * 2


def test_a_mode_that_was_entered_dwells() -> None:
    made = _begun()
    _due(made, 1.0, bad=True)
    made.entered(DEGRADE, 1.2, TIMES)
    _due(made, 1.3, bad=False)
    assert _due(made, 2.1, bad=False) == ""
    assert _due(made, 2.2, bad=False) == "normal"


def test_a_manual_change_wins_for_a_while() -> None:
    made = _begun("degraded")
    _due(made, 0.0, bad=True)
    assert made.see(_modes("normal"), 10.0, TIMES) == [""]
    assert _due(made, 39.9, bad=True) == ""
    assert _due(made, 40.0, bad=True) == "degraded"


def test_what_was_given_up_is_known_after_the_revision_that_it_waited_for_was_undone() -> None:
    made = _begun("normal")
    made.asking(DEGRADE, 1)
    assert made.see(replace(_modes("normal"), revision=2), 1.0, TIMES, final=False) == []
    assert made.see(_modes("degraded"), 2.0, TIMES) == []
    assert made.see(replace(_modes("normal"), revision=2), 3.0, TIMES) == [""]


def test_all_modes_that_were_given_up_are_known() -> None:
    made = _begun("normal")
    stop = replace(DEGRADE, name="stop", mode="stopped")
    made.asking(DEGRADE, 1)
    made.asking(stop, 1)
    made.answered(stop)
    assert made.see(replace(_modes("degraded"), revision=2), 1.0, TIMES) == []


def test_an_undo_back_to_no_target_is_a_manual_change_too() -> None:
    made = _begun("")
    _due(made, 1.0, bad=True)
    made.asking(DEGRADE, 1)
    made.entered(DEGRADE, 1.2, TIMES)
    assert made.see(_modes("degraded"), 1.3, TIMES) == []
    assert made.see(_modes(""), 10.0, TIMES) == [""]
    assert _due(made, 39.9, bad=True) == ""
    assert _due(made, 40.0, bad=True) == "degraded"


def test_a_setting_that_was_changed_by_hand_is_a_manual_change_too() -> None:
    made = _begun("degraded")
    _due(made, 0.0, bad=True)
    assert made.see(_modes("degraded", as_asked=False), 10.0, TIMES) == [""]
    assert _due(made, 20.0, bad=True) == ""
    assert _due(made, 40.0, bad=True) == "degraded"


def test_what_was_asked_for_without_an_answer_is_no_manual_change() -> None:
    made = _begun()
    made.asking(DEGRADE, 0)
    again = Enforcement(made.remembered())
    again.take_rules((DEGRADE, RECOVER))
    assert again.see(_modes("degraded"), 5.0, TIMES) == []


def test_what_was_asked_for_without_an_answer_may_be_entered_on_that_revision_alone() -> None:
    for revision, manual in ((1, []), (2, [""])):
        made = _begun()
        made.asking(DEGRADE, 1)
        assert made.see(replace(_modes("normal"), revision=revision), 1.0, TIMES) == []
        assert made.see(replace(_modes("degraded"), revision=revision + 1), 2.0, TIMES) == manual


def test_what_was_asked_for_and_answered_is_forgotten() -> None:
    made = _begun()
    made.asking(DEGRADE, 1)
    made.answered(DEGRADE)
    assert made.see(_modes("normal"), 1.0, TIMES) == []
    assert made.see(replace(_modes("degraded"), revision=2), 2.0, TIMES) == [""]


def test_rules_that_circle_are_suspended_but_for_the_first() -> None:
    made = _begun()
    found = [made.entered(rule, 2.0 * turn, TIMES) for turn in range(3) for rule in (DEGRADE, RECOVER)]
    assert found[:4] == [None] * 4
    assert found[4] is not None
    assert (found[4].suspended, found[4].until) == (("recover",), 64.0)
    made.see(_modes("degraded"), 6.0, TIMES)
    made.parts[""].manual_until = 0.0
    assert _due(made, 6.0, bad=False) == ""
    assert _due(made, 10.0, bad=False) == ""
    assert _due(made, 64.0, bad=False) == "normal"
    assert Enforcement(made.remembered()).suspended == {"recover": 64.0}


def test_a_mode_that_cannot_be_entered_is_tried_again_after_a_while() -> None:
    made = _begun()
    _due(made, 0.0, bad=True)
    made.refused(DEGRADE, 1.0, TIMES)
    assert _due(made, 1.9, bad=True) == ""
    assert _due(made, 2.0, bad=True) == "degraded"


def test_a_mode_that_an_earlier_run_has_entered_is_not_taken_for_a_manual_one() -> None:
    made = _begun()
    assert made.see(_modes("degraded"), 1.0, TIMES, own={"": "degraded"}) == []
    assert made.see(_modes("normal"), 2.0, TIMES) == [""]


def test_a_mode_in_force_stays_entered_once_where_modes_are_tried_again_at_once() -> None:
    made, times = _begun(), replace(TIMES, retry=0.0)
    _due(made, 1.0, bad=True)
    made.entered(DEGRADE, 1.2, times)
    made.look({"bad": True}, 5.0)
    assert made.due(5.0, times) is None
    made.look({"bad": True}, 6.0, ("degraded",))
    assert made.due(6.0, times) is DEGRADE


def test_a_mode_that_a_component_has_fallen_out_of_is_entered_again_while_its_rule_holds() -> None:
    made = _begun("normal")

    def due(now: float, *fallen: str, bad: bool = False) -> str:
        made.look({"bad": bad}, now, fallen)
        rule = made.due(now, TIMES)
        return rule.mode if rule else ""

    assert [due(now, "normal") for now in (1.0, 1.9)] == ["", ""]
    assert due(1.95) == ""
    assert [due(now, "normal") for now in (2.0, 2.9, 3.0)] == ["", "", "normal"]
    made.entered(RECOVER, 3.0, TIMES)
    assert due(3.9, "normal") == ""
    assert due(4.5, "normal", bad=True) == ""
    assert due(4.7, "normal", bad=True) == "degraded"


def _line(actor: str, *modes: str, applied: bool = True, undoes: str = "") -> AdaptationReport:
    changes: tuple[Change, ...] = tuple(map(EnterMode, modes)) or (SetParameters("laser", {"rate": 1.0}),)
    outcome = Outcome.APPLIED if applied else Outcome.ROLLED_BACK
    return AdaptationReport("1", outcome, AdaptationRequest(changes, actor=actor, undoes=undoes), 1, 1 + applied, 0.0)


@pytest.mark.parametrize(
    ("newest_first", "own"),
    [
        ([_line("planner", "degraded")], {"": "degraded"}),
        ([_line("somebody"), _line("planner", "degraded")], {"": "degraded"}),
        ([_line("somebody", "normal"), _line("planner", "degraded")], {}),
        ([_line("somebody", "normal", applied=False), _line("planner", "degraded")], {"": "degraded"}),
        ([_line("planner", "degraded", applied=False)], {}),
        ([_line("somebody", "laser.slow"), _line("planner", "degraded")], {"": "degraded"}),
        ([_line("planner", "normal"), _line("planner", "degraded")], {"": "normal"}),
        ([_line("planner", "night")], {"": "night", "laser": "laser.slow"}),
    ],
)
def test_a_mode_is_the_planner_s_own_until_others_enter_one_of_its_part(
    newest_first: list[AdaptationReport], own: dict[str, str]
) -> None:
    assert entered_by("planner", newest_first, {"night": ("laser.slow",)}) == own
