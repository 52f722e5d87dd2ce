"""Components are swapped while the system runs: another run continues where the previous one stopped, or nothing is."""

from __future__ import annotations

from dataclasses import replace

import pytest

from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
    StepState,
    Swap,
)
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.swaps.relaying import (
    ANOTHER,
    DOUBLER,
    all_is_well,
    as_before,
    class_of,
    faults,
    hears_on,
    runs,
)
from tests.adaptation.system import System
from tests.handover.parts import Ask, Item
from tests.support.waiting import PATIENCE


def test_another_class_goes_on_from_the_state_and_nothing_is_missed(site: System) -> None:
    report = site.adapt(DOUBLER)
    assert report.outcome is Outcome.APPLIED, report
    assert [step.action for step in report.steps] == [
        "start tests.handover.parts:Doubler beside it",
        "hand over to tests.handover.parts:Doubler",
    ]
    view = site.view("totaller")
    assert (view.state, view.revision, view.parameters["offset"]) == (State.ACTIVE, 2, 3)
    assert site.client.call("double", Ask(21), Item, PATIENCE) == Item(42)
    assert site.host.specs["totaller"].cls == DOUBLER.cls
    assert site.host.specs["totaller"].restart == site.architecture.components["totaller"].restart
    assert (runs(site), site.host.beside) == ([2], {})
    all_is_well(site)


def test_values_and_connections_that_both_have_are_kept_and_others_are_as_the_class_has_them(site: System) -> None:
    site.adapt(SetParameters("totaller", {"offset": 4}))
    report = site.adapt(Swap("totaller", class_of("Counting"), {"label": "fancy"}, {"spare": "others"}))
    assert report.outcome is Outcome.APPLIED, report
    view = site.view("totaller")
    assert (view.parameters["offset"], view.parameters["label"]) == (4, "fancy")
    assert view.connections == {"items": "items", "spare": "others", "totals": "totals", "config": "config"}
    assert site.host.specs["totaller"].connections == {"items": "items", "spare": "others", "totals": "totals"}
    assert site.client.call("configured", Ask(), Item, PATIENCE) == Item(1, 4)
    all_is_well(site)


def test_the_same_class_is_swapped_for_what_is_fixed_when_it_starts(site: System) -> None:
    assert site.adapt(Swap("totaller", class_of("Counting"))).outcome is Outcome.APPLIED
    report = site.adapt(Swap("totaller", parameters={"label": "fancy"}))
    assert report.outcome is Outcome.APPLIED, report
    assert site.view("totaller").parameters["label"] == "fancy"
    all_is_well(site)


def test_a_state_is_converted_by_a_class_that_can_or_left_behind_if_so_wanted(site: System) -> None:
    rejected = site.adapt(Swap("totaller", class_of("Newer", "tests.handover.parts")))
    assert rejected.outcome is Outcome.REJECTED
    assert [v.field for v in rejected.violations] == ["with_state"]
    assert "version 1" in rejected.violations[0].problem
    assert site.adapt(Swap("totaller", class_of("Second"))).outcome is Outcome.APPLIED
    all_is_well(site)
    rejected = site.adapt(DOUBLER)
    assert rejected.outcome is Outcome.REJECTED
    report = site.adapt(Swap("totaller", DOUBLER.cls, with_state=False))
    assert report.outcome is Outcome.APPLIED, report
    hears_on(site)
    assert faults(site) == (0, 0, 0, 1)  # the total began anew, once


def test_whoever_cannot_say_its_state_is_swapped_without_it(site: System) -> None:
    assert site.adapt(Swap("totaller", class_of("Mute"))).outcome is Outcome.APPLIED
    with_state = site.adapt(DOUBLER)
    assert (with_state.outcome, "cannot say how I am" in with_state.error) == (Outcome.ROLLED_BACK, True), with_state
    without = site.adapt(replace(DOUBLER, with_state=False))
    assert without.outcome is Outcome.APPLIED, without
    assert site.client.call("double", Ask(21), Item, PATIENCE) == Item(42)


@pytest.mark.parametrize("many", [True, False])
def test_a_state_that_is_too_large_to_hand_over_rolls_back_and_nothing_is_lost(site: System, many: bool) -> None:
    assert site.adapt(Swap("totaller", class_of("Hoarder"), {"many": many})).outcome is Outcome.APPLIED
    report = site.adapt(Swap("totaller", class_of("Counting")))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "64 MB" in report.error
    all_is_well(site)


@pytest.mark.parametrize(
    "changes",
    [
        (SetParameters("totaller", {"offset": 4}), DOUBLER),
        (DOUBLER, SetParameters("totaller", {"offset": 4})),
        (Connect("totaller", "config", "others"), DOUBLER),
        (DOUBLER, Connect("totaller", "config", "others")),
        (DOUBLER, Add("second", ANOTHER)),
        (Remove("fragile"), DOUBLER),
        (DOUBLER, Swap("fragile", parameters={"level": 3})),
    ],
)  # fmt: skip
def test_with_other_changes_in_one_adaptation(site: System, changes: tuple[Change, ...]) -> None:
    report = site.adapt(*changes)
    assert report.outcome is Outcome.APPLIED, report
    assert site.host.specs["totaller"].cls == DOUBLER.cls
    all_is_well(site)
    undone = site.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    assert site.host.specs["totaller"].cls == site.architecture.components["totaller"].cls
    assert site.view("totaller").parameters["offset"] == 3
    all_is_well(site)


def test_what_is_inactive_stays_so(site: System) -> None:
    report = site.adapt(ChangeState("fragile", Transition.DEACTIVATE), Swap("fragile", parameters={"level": 2}))
    assert report.outcome is Outcome.APPLIED, report
    view = site.view("fragile")
    assert (view.state, view.parameters["level"]) == (State.INACTIVE, 2)
    assert site.host.specs["fragile"].state is State.INACTIVE
    assert site.adapt(ChangeState("fragile", Transition.ACTIVATE)).outcome is Outcome.APPLIED


def test_what_is_unconfigured_is_swapped_for_one_that_is(site: System) -> None:
    site.adapt(ChangeState("fragile", Transition.DEACTIVATE), ChangeState("fragile", Transition.CLEANUP))
    report = site.adapt(Swap("fragile", parameters={"level": 2}))
    assert report.outcome is Outcome.APPLIED, report
    assert site.view("fragile").state is State.UNCONFIGURED
    assert site.view("fragile").parameters["level"] == 2


def test_what_is_configured_in_the_same_adaptation_is_swapped_then(site: System) -> None:
    site.adapt(ChangeState("fragile", Transition.DEACTIVATE), ChangeState("fragile", Transition.CLEANUP))
    swap = Swap("fragile", parameters={"level": 2})
    report = site.adapt(ChangeState("fragile", Transition.CONFIGURE), swap)
    assert report.outcome is Outcome.APPLIED, report
    assert site.view("fragile").state is State.INACTIVE


def test_what_is_taken_down_and_swapped_in_one_adaptation_is_up_again_where_this_fails(site: System) -> None:
    before = site.views()
    down = [ChangeState("fragile", each) for each in (Transition.DEACTIVATE, Transition.CLEANUP)]
    swap = Swap("fragile", parameters={"level": 2})
    report = site.adapt(*down, swap, Swap("totaller", class_of("Broken")))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "not like this" in report.error
    assert site.views()["fragile"][1:] == before["fragile"][1:]
    assert site.adapt(*down, swap).outcome is Outcome.APPLIED
    assert (site.view("fragile").state, site.view("fragile").parameters["level"]) == (State.UNCONFIGURED, 2)


@pytest.mark.parametrize(
    ("cls", "text"),
    [
        (class_of("Broken"), "not like this"),
        (class_of("Lame"), "cannot get up"),
        (class_of("Unable", "tests.handover.parts"), "not this one"),
    ],
)
def test_a_successor_that_cannot_go_on_leaves_everything_as_it_was(site: System, cls: str, text: str) -> None:
    run, before = site.running["totaller"], site.views()
    report = site.adapt(Swap("totaller", cls))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert text in report.error
    as_before(site, run, before)
    assert site.adapt(DOUBLER).outcome is Outcome.APPLIED
    all_is_well(site)


def test_a_later_failure_hands_the_living_state_back_to_the_process_of_before(site: System) -> None:
    site.adapt(SetParameters("fragile", {"mood": "refuses"}))
    run, before = site.running["totaller"], site.views()
    report = site.adapt(DOUBLER, SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert [step.state for step in report.steps] == [StepState.UNDONE] * 3
    site.architecture = site.host.architecture
    assert site.running["totaller"] is run
    after = site.views()
    assert {name: view[1:] for name, view in after.items()} == {name: view[1:] for name, view in before.items()}
    all_is_well(site)
    assert site.adapt(DOUBLER).outcome is Outcome.APPLIED
    all_is_well(site)


def test_undoing_a_swap_is_refused_where_a_later_adaptation_has_decided_otherwise(site: System) -> None:
    swapped = site.adapt(DOUBLER)
    later = site.adapt(SetParameters("totaller", {"offset": 4}))
    refused = site.undo(swapped.id)
    assert refused.outcome is Outcome.REJECTED
    assert [v.field for v in refused.violations] == ["parameters.offset"]
    assert site.undo(later.id).outcome is Outcome.APPLIED
    assert site.undo(swapped.id).outcome is Outcome.APPLIED
    all_is_well(site)


def test_undoing_a_swap_is_refused_where_a_later_one_has_named_a_service(site: System) -> None:
    swapped = site.adapt(DOUBLER)
    later = site.adapt(Swap("totaller", services={"double": "twice"}))
    refused = site.undo(swapped.id)
    assert refused.outcome is Outcome.REJECTED, refused
    assert [v.field for v in refused.violations] == ["services.double"]
    assert f"adaptation {later.id}" in refused.violations[0].problem
    assert site.host.specs["totaller"].services["double"] == "twice"
    assert site.undo(later.id).outcome is Outcome.APPLIED
    assert site.undo(swapped.id).outcome is Outcome.APPLIED
    all_is_well(site)


def test_a_dry_run_says_what_would_be(site: System) -> None:
    report = site.adapt(DOUBLER, dry_run=True)
    assert report.outcome is Outcome.PENDING
    assert report.architecture is not None
    assert report.architecture.components["totaller"].cls == DOUBLER.cls
    assert (runs(site), site.host.beside) == ([1], {})
