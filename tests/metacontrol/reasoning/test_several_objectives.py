"""Several objectives are decided together: by priority, without clashes, and with what their designs require."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning import design_selection
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import Against
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import Clash
from tests.metacontrol.owl import NAVIGATE, PERFORMANCE, SAFETY, design, individual, iri, write
from tests.metacontrol.reasoning.cycle import FAILED, RECOVERED, Cycle, objective

RECHARGE = "nav:to_recharge"


def clash_of_modes(modes: Mapping[str, Mapping[str, str]]) -> Clash:
    """Return a test by the modes into which each design puts its components: two modes of one exclude each other."""

    def clash(one: str, other: str) -> str:
        mine, others = modes.get(one, {}), modes.get(other, {})
        for component in mine.keys() & others.keys():
            if mine[component] != others[component]:
                short = local_name(component)
                return f"it needs {short} in {mine[component]!r}, and {local_name(other)} in {others[component]!r}"
        return ""

    return clash


CAMERA_MODES = clash_of_modes(
    {
        iri("watch"): {iri("nav:camera"): "active.WIDE"},
        iri("dock"): {iri("nav:camera"): "active.NEAR"},
        iri("blind"): {iri("nav:battery"): "active"},
    }
)
PARTS = (
    design("watch", NAVIGATE, {PERFORMANCE: 0.9}),
    design("blind", NAVIGATE, {PERFORMANCE: 0.1}),
    design("dock", RECHARGE, {PERFORMANCE: 0.9}),
)


def test_the_higher_priority_is_decided_first_and_the_loser_has_the_reason(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, *PARTS), objective(), objective("charge", RECHARGE, priority=1), clash=CAMERA_MODES)
    cycle.run()
    assert cycle.decision("charge").design == iri("dock")
    assert cycle.decision("drive").design == iri("blind")
    (objection,) = cycle.decision("drive").assessments[0].against
    assert objection.kind is Against.CLASH
    assert objection.holder == iri("charge")
    assert objection.why == "it needs camera in 'active.WIDE', and dock in 'active.NEAR', which charge holds"


def test_of_equal_priorities_the_first_objective_is_decided_first(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, *PARTS), objective(), objective("charge", RECHARGE), clash=CAMERA_MODES)
    cycle.run()
    assert cycle.decision("drive").design == iri("watch")
    assert cycle.decision("charge").design is None
    assert cycle.decision("charge").status is Status.UNGROUNDED
    assert "which drive holds" in cycle.decision("charge").why


def test_a_new_objective_with_a_higher_priority_takes_what_it_needs(tmp_path: Path) -> None:
    first = objective()
    cycle = Cycle(write(tmp_path, *PARTS), first, clash=CAMERA_MODES)
    assert cycle.design() == "watch"
    cycle.situation = replace(cycle.situation, objectives=(first, objective("charge", RECHARGE, priority=5)))
    assert cycle.design() == "blind"
    assert cycle.decision("charge").design == iri("dock")


REQUIRING = (
    design("far", NAVIGATE, {PERFORMANCE: 0.9}, mros__fd_requiresO=">power"),
    design("near", NAVIGATE, {PERFORMANCE: 0.3}),
    individual("power", "tomasys:Objective", tomasys__typeF=f">{RECHARGE}", tomasys__hasNFR=">bound"),
    individual("bound", "tomasys:QAvalue", tomasys__isQAtype=f">{SAFETY}", tomasys__hasValue=0.5),
    design("plug", RECHARGE, {SAFETY: 0.9}, ("nav:camera",)),
    design("swap", RECHARGE, {SAFETY: 0.4}),
)


def test_what_a_design_requires_is_decided_in_the_same_plan(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, *REQUIRING), objective())
    assert cycle.design() == "far"
    (drive, power) = cycle.plan.decisions
    assert (power.objective, power.parent, power.design) == (iri("drive/power"), iri("drive"), iri("plug"))
    assert drive.parent == ""
    assert cycle.design() == "far"
    assert not any(each.is_change for each in cycle.plan.decisions)


def test_a_design_whose_requirement_has_no_design_is_not_selected(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, *REQUIRING), objective())
    cycle.run()
    cycle.set_components(camera=FAILED)
    assert cycle.design() == "near"
    assert len(cycle.plan.decisions) == 1
    (objection,) = cycle.decision().assessments[0].against
    assert objection.kind is Against.REQUIRED
    assert objection.why.startswith(
        "it requires to_recharge, which has no design: plug: not realisable: camera has failed"
    )
    assert cycle.analysis.objectives[iri("drive")].status is Status.IN_ERROR_COMPONENT, "copied up from its requirement"
    cycle.set_components(camera=RECOVERED)
    assert cycle.design() == "near", "the objective's own designs do not require the camera"


def test_an_error_of_a_required_objective_does_not_blame_the_design_that_requires_it(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, *REQUIRING, design("third", RECHARGE, {SAFETY: 0.8})), objective())
    cycle.run()
    cycle.measure(SAFETY, 0.1, "drive/power")
    assert cycle.design() == "far"
    assert cycle.plan.decisions[1].design == iri("third")
    assert [rest.design for rest in cycle.resting.all(cycle.now)] == [iri("plug")]


def test_a_clash_with_what_a_higher_objective_requires_names_the_holder(tmp_path: Path) -> None:
    clash = clash_of_modes({iri("plug"): {"c": "one"}, iri("charge"): {"c": "two"}})
    parts = (*REQUIRING, individual("f", "tomasys:Function"), design("charge", "f", {}))
    cycle = Cycle(write(tmp_path, *parts), objective(priority=1), objective("other", "f"), clash=clash)
    cycle.run()
    assert cycle.decision("other").design is None
    assert cycle.decision("other").assessments[0].against[0].holder == iri("drive/power")


def test_another_design_is_tried_when_what_the_first_requires_clashes(tmp_path: Path) -> None:
    clash = clash_of_modes({iri("plug"): {"c": "one"}, iri("charge"): {"c": "two"}})
    parts = (*REQUIRING, individual("f", "tomasys:Function"), design("charge", "f", {}))
    cycle = Cycle(write(tmp_path, *parts), objective(), objective("other", "f", priority=1), clash=clash)
    assert cycle.design() == "near"
    assert "which other holds" in cycle.decision().assessments[0].against[0].why


@pytest.mark.parametrize("length", [1, 2, 3])
def test_functions_that_require_each_other_have_no_design(tmp_path: Path, length: int) -> None:
    parts = [
        individual(f"f{i}", "tomasys:Function")
        + individual(f"o{i}", "tomasys:Objective", tomasys__typeF=f">f{i}")
        + design(f"d{i}", f"f{i}", {}, mros__fd_requiresO=f">o{(i + 1) % length}")
        for i in range(length)
    ]
    cycle = Cycle(write(tmp_path, *parts), objective(function="f0"))
    assert cycle.design() is None
    assert "its function requires itself" in cycle.decision().why


def test_a_search_without_an_end_in_sight_is_given_up(tmp_path: Path) -> None:
    """Eight functions have eight designs each, all of which require the next; the last has none: 8 ** 8 ways."""
    parts = []
    for level in range(9):
        parts.append(individual(f"f{level}", "tomasys:Function"))
        parts.append(individual(f"o{level}", "tomasys:Objective", tomasys__typeF=f">f{level}"))
        if level < 8:
            parts += [design(f"d{level}_{i}", f"f{level}", {}, mros__fd_requiresO=f">o{level + 1}") for i in range(8)]
    cycle = Cycle(write(tmp_path, *parts), objective(function="f0"))
    assert cycle.design() is None
    assert "the search was given up after" in cycle.decision().why


def test_the_context_selects_designs_and_else_the_default_ones(tmp_path: Path) -> None:
    parts = (
        design("day", NAVIGATE, {PERFORMANCE: 0.5}),
        design("night", NAVIGATE, {PERFORMANCE: 0.9}, mros__fd_context="Dark"),
        design("plug", RECHARGE, {}),
    )
    cycle = Cycle(write(tmp_path, *parts), objective(), objective("charge", RECHARGE))
    assert cycle.design() == "day"
    cycle.situation = replace(cycle.situation, context="Dark")
    assert cycle.design() == "night"
    assert cycle.decision("charge").design == iri("plug"), "it has no design for the dark"
    cycle.situation = replace(cycle.situation, context="Default")
    assert cycle.design() == "day"


def test_a_search_that_is_given_up_leaves_other_objectives_their_share(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design_selection, "MAX_TRIES", 10)
    many = [design(f"way_{number}", RECHARGE, {PERFORMANCE: 0.5}) for number in range(20)]
    taken = {iri(f"way_{number}"): {iri("nav:camera"): "active.NEAR"} for number in range(20)}
    clash = clash_of_modes({iri("watch"): {iri("nav:camera"): "active.WIDE"}, **taken})
    given = (objective(priority=2), objective("charge", RECHARGE, priority=1), objective("again"))
    cycle = Cycle(write(tmp_path, PARTS[0], *many), *given, clash=clash)
    cycle.run()
    assert cycle.decision("drive").design == iri("watch")
    assert cycle.decision("charge").design is None
    assert cycle.decision("again").design == iri("watch")
