"""The inverse of any list of changes leads back to where it began."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.adaptation_manager.execution.undo_changes import conflicts, inverse
from regraft.adaptation_manager.steps import PLANNERS
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Add,
    Change,
    ChangeState,
    Connect,
    Outcome,
    Remove,
    SetParameters,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import Transition
from tests.adaptation.system import small_architecture

BEFORE = small_architecture()
LISTENERS = st.sampled_from(["listener", "second"])
CHANGES = st.one_of(
    st.builds(SetParameters, LISTENERS, st.fixed_dictionaries({"gain": st.floats(0, 1), "label": st.just("fancy")})),
    st.builds(Connect, LISTENERS, st.sampled_from(["heard", "hint"]), st.sampled_from(["numbers", "others"])),
    st.builds(ChangeState, LISTENERS, st.sampled_from([t for t in Transition if t is not Transition.SHUTDOWN])),
)


def _after(architecture: Architecture, changes: tuple[Change, ...]) -> tuple[Architecture, bool]:
    draft = Draft(architecture, {})
    for change in changes:
        PLANNERS[change.change](draft, change)
    return draft.architecture, not draft.violations


@given(st.lists(CHANGES, min_size=1, max_size=8))
def test_the_inverse_of_changes_leads_back(wanted: list[Change]) -> None:
    changes: tuple[Change, ...] = ()
    for change in wanted:
        if _after(BEFORE, (*changes, change))[1]:
            changes = (*changes, change)
    behind, _ = _after(BEFORE, changes)
    back, legal = _after(behind, inverse(changes, BEFORE))
    assert legal
    report = AdaptationReport("2", Outcome.APPLIED, AdaptationRequest(changes), 1, 2, 0.0)
    assert conflicts(report, BEFORE, back, []) == []


@pytest.mark.parametrize("same", [True, False])
def test_an_added_component_is_not_removed_if_by_now_it_is_another_one_of_that_name(same: bool) -> None:
    first = BEFORE.components["listener"]
    second = replace(first, cls=first.cls if same else "other:Class")
    behind = BEFORE
    report = AdaptationReport("2", Outcome.APPLIED, AdaptationRequest((Add("listener", first),)), 1, 2, 0.0)
    later = [
        AdaptationReport("4", Outcome.APPLIED, AdaptationRequest((Add("listener", second),)), 3, 4, 0.0),
        AdaptationReport("3", Outcome.APPLIED, AdaptationRequest((Remove("listener"),)), 2, 3, 0.0),
    ]
    found = conflicts(report, behind, behind.with_component(second), later)
    assert [each.field for each in found] == ([] if same else ["component"])
    assert all("by adaptation 4, 3: it is 'other:Class on local'" in each.problem for each in found)
