"""Utility is credited to the option that earned it, once, and to nobody else."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.bus_schema.messages.planning import Proposal
from regraft.bus_schema.model.adaptation import Outcome
from regraft.bus_schema.model.lifecycle import State
from tests.planners.parts import SPEEDS, TOPICS, Bench, bench

SPEED = "navigator.max_velocity"


def speed(proposal: Proposal) -> float:
    chosen: float = proposal.choice["option"][SPEED]
    return chosen


def known(on: Bench, strategy: str = "ucb1", task: str = "drive") -> list[list[float]]:
    """Return what a strategy knows: count and mean of each option credited, in the order of the last credit."""
    learned = on.planner.snapshot()[task]["learned"].get(strategy)
    return [[count, mean] for count, mean, _ in learned[1].values()] if learned else []


def test_the_utility_measured_under_an_option_makes_that_option_better() -> None:
    worth = {0.1: 0.2, 0.18: 0.9, 0.26: 0.4}
    with bench() as on:
        credit: dict[str, Any] = {}
        chosen = []
        for _ in range(60):
            proposal = on.propose(settle=0.5, **credit)
            chosen.append(speed(proposal))
            credit = {"credit": on.earn(proposal, worth[speed(proposal)])}
        assert chosen[:3] == [0.1, 0.18, 0.26]
        assert chosen.count(0.18) > 30
        on.propose(**credit)
        assert {round(mean, 9) for _, mean in known(on)} == {0.2, 0.9, 0.4}


def test_what_was_measured_before_the_effect_settled_is_not_credited() -> None:
    with bench() as on:
        first = on.propose(settle=1.0)
        assert first.choice["measure_from"] == first.choice["applied"] + 1.0
        on.rig.advance(3.0)
        early = {"ticket": first.ticket, "utility": 0.9, "from": 0.5, "to": 3.0}
        told = on.propose(credit=early, apply=False).choice["credit"]
        assert told["credited"] is False
        assert told["why"] == "measured from 0.5, but the effect of the choice can be measured from 1 on"
        assert known(on) == []
        right = on.propose(credit={**early, "from": 1.0}, apply=False).choice["credit"]
        assert right == {"ticket": first.ticket, "credited": True, "utility": 0.9, "why": ""}
        assert known(on) == [[1, 0.9]]


def test_what_was_measured_in_part_under_the_next_option_is_not_credited() -> None:
    with bench() as on:
        first = on.propose()
        on.rig.advance(2.0)
        second = on.propose()
        assert second.changes
        on.rig.advance(2.0)
        late = {"ticket": first.ticket, "utility": 0.9, "from": 1.0, "to": 3.0}
        why = on.propose(credit=late, apply=False).choice["credit"]["why"]
        assert why == "measured until 3, but the choice stood until 2 only"
        assert on.propose(credit={**late, "to": 2.0}, apply=False).choice["credit"]["credited"]


def test_a_ticket_is_credited_once() -> None:
    with bench() as on:
        credit = on.earn(on.propose(), 0.7)
        assert on.propose(credit=credit, apply=False).choice["credit"]["credited"]
        again = on.propose(credit=credit, apply=False).choice["credit"]
        assert (again["credited"], again["why"]) == (False, "this ticket was credited already")
        assert known(on) == [[1, 0.7]]


def test_an_unknown_ticket_is_said_and_changes_nothing() -> None:
    with bench() as on:
        credit = on.earn(on.propose(), 0.7)
        for unknown in ({**credit, "ticket": "7-beef"}, {**credit, "ticket": ""}):
            told = on.propose(credit=unknown, apply=False).choice["credit"]
            assert (told["credited"], told["why"]) == (False, "this ticket is not known, or too old")
        other = on.propose(credit=credit, task="another", apply=False).choice["credit"]
        assert not other["credited"]
        assert known(on) == []


@pytest.mark.parametrize("fate", [Outcome.REJECTED, Outcome.ROLLED_BACK, Outcome.CANCELLED, Outcome.STUCK])
def test_a_choice_that_was_not_applied_has_no_ticket_and_its_report_tells_why(fate: Outcome) -> None:
    with bench() as on:
        on.manager.fates = [fate]
        proposal = on.propose()
        assert proposal.ticket == ""
        assert proposal.choice["outcome"] == fate.value
        assert proposal.report is not None
        assert proposal.report.outcome is fate
        assert "applied" not in proposal.choice


def test_after_a_rejection_the_option_that_still_stands_can_be_credited_and_after_a_rollback_only_up_to_it() -> None:
    for fate, credited in ((Outcome.REJECTED, True), (Outcome.ROLLED_BACK, False)):
        with bench() as on:
            first = on.propose()
            on.rig.advance(1.0)
            on.manager.fates = [fate]
            assert not on.propose().ticket
            on.rig.advance(1.0)
            credit = {"ticket": first.ticket, "utility": 0.5, "from": 0.0, "to": 2.0}
            assert on.propose(credit=credit, apply=False).choice["credit"]["credited"] is credited


def test_what_somebody_else_has_changed_meanwhile_is_not_credited() -> None:
    with bench() as on:
        credit = on.earn(on.propose(options=(SPEEDS, TOPICS)), 0.7)
        on.manager.set("navigator", parameters={"max_velocity": 0.2})
        told = on.propose(credit=credit, apply=False).choice["credit"]
        assert (told["credited"], told["why"]) == (False, f"somebody else has changed {SPEED} since")
        on.manager.set("navigator", parameters={"max_velocity": 0.1})
        on.manager.set("drive", state=State.INACTIVE)
        assert on.propose(credit=credit, apply=False).choice["credit"]["credited"]


def test_a_choice_that_stands_already_needs_no_adaptation_and_has_a_ticket() -> None:
    with bench() as on:
        only = [{**SPEEDS, "values": [0.26]}]
        proposal = on.propose(options=only, settle=1.0)
        assert (proposal.choice["outcome"], proposal.changes, proposal.report) == ("unchanged", (), None)
        assert on.manager.requests == []
        assert on.propose(options=only, credit=on.earn(proposal, 0.6)).choice["credit"]["credited"]


def test_a_choice_made_again_has_settled_already() -> None:
    with bench() as on:
        only = [{**SPEEDS, "values": [0.1]}]
        first = on.propose(options=only, settle=1.0)
        on.rig.advance(0.4)
        assert on.propose(options=only, settle=1.0).choice["measure_from"] == first.choice["measure_from"] == 1.0
        on.rig.advance(4.6)
        assert on.propose(options=only, settle=1.0).choice["measure_from"] == 5.0


@pytest.mark.parametrize(("utility", "counted"), [(12.0, 1.0), (-3.0, 0.0), (7.5, 0.75)])
def test_utility_outside_its_range_is_clipped_and_that_is_said(utility: float, counted: float) -> None:
    with bench() as on:
        credit = on.earn(on.propose(knobs={"low": 0.0, "high": 10.0}), utility)
        notes = on.propose(credit=credit, knobs={"low": 0.0, "high": 10.0}).choice["notes"]
        clipped = [f"utility {utility:g} was clipped to the range [0, 10]"] if counted in (0.0, 1.0) else []
        assert notes == clipped
        assert known(on) == [[1, counted]]


def test_with_another_range_of_utility_a_strategy_begins_anew_and_says_it() -> None:
    with bench() as on:
        first = on.propose()
        credit = on.earn(first, 0.7)
        fresh = on.propose(knobs={"high": 5.0})
        assert fresh.choice["notes"] == ["ucb1 begins anew: the utility's range went from [0, 1] to [0, 5]"]
        assert speed(fresh) == 0.18
        told = on.propose(credit=credit, knobs={"high": 5.0}, apply=False).choice["credit"]
        assert told["why"] == "the strategy has begun anew since"


def test_other_knobs_hold_from_the_next_choice_on_and_nothing_is_forgotten() -> None:
    with bench() as on:
        for utility in (0.9, 0.1, 0.2):
            proposal = on.propose(options=(SPEEDS,))
            on.propose(credit=on.earn(proposal, utility), apply=False)
        assert on.propose(knobs={"exploration": 0.0}, apply=False).choice["why"].startswith("best index, 0.9 ")
        assert on.propose(knobs={"exploration": 2.0}, apply=False).choice["why"].startswith("best index, 3.8")


def test_the_strategy_that_chose_is_the_one_that_learns() -> None:
    with bench() as on:
        credit = on.earn(on.propose("ucb1"), 0.7)
        on.propose("thompson", credit=credit)
        assert known(on, "ucb1") == [[1, 0.7]]
        assert known(on, "thompson") == []
        assert on.propose("ucb1", apply=False).choice["option"] == {SPEED: 0.18}


def test_what_was_learned_survives_other_lists_of_options() -> None:
    with bench() as on:
        for utility in (0.1, 0.9, 0.2):
            on.propose(credit=on.earn(on.propose(), utility), apply=False)
        shuffled = [{**SPEEDS, "name": "v", "values": [0.26, 0.18]}]
        greedy: dict[str, Any] = {"knobs": {"exploration": 0.0}, "apply": False}
        assert on.propose(options=shuffled, **greedy).choice["option"] == {"v": 0.18}
        longer = [{**SPEEDS, "values": [0.05, 0.26, 0.18, 0.1]}]
        assert on.propose(options=longer, **greedy).choice["option"] == {SPEED: 0.05}


def test_a_dry_proposal_is_what_the_next_one_chooses_and_touches_nothing() -> None:
    with bench() as on:
        for strategy in ("random", "thompson", "epsilon_greedy"):
            before = on.manager.architecture
            dry = [on.propose(strategy, apply=False) for _ in range(3)]
            assert dry[0] == dry[1] == dry[2]
            assert (dry[0].ticket, dry[0].report, dry[0].choice["outcome"]) == ("", None, "dry")
            assert on.manager.architecture is before
            done = on.propose(strategy)
            assert (done.choice["option"], done.changes) == (dry[0].choice["option"], dry[0].changes)
