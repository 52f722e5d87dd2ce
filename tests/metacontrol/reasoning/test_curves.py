"""The utility of a design may be read from curves, of the qualities or of the objective."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective, objective_problems
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import Assessment
from tests.metacontrol.owl import NAVIGATE, design, individual, iri, write
from tests.metacontrol.reasoning.cycle import Cycle, objective

WAIT, CARE = "wait", "care"
ENOUGH = Curve(((0.0, 0.0), (0.5, 1.0)))
PARTS = (
    individual(WAIT, "tomasys:QualityAttributeType", mros__qa_direction="LOWER", mros__qa_weight=0.5),
    individual(
        CARE,
        "tomasys:QualityAttributeType",
        mros__qa_direction="HIGHER",
        mros__qa_weight=1,
        mros__qa_curve="0: 0, 0.5: 0.8, 1: 1",
    ),
    design("hasty", NAVIGATE, {WAIT: 0.1, CARE: 0.4}),
    design("calm", NAVIGATE, {WAIT: 0.6, CARE: 1.0}),
    design("unknown", NAVIGATE, {WAIT: 0.1}),
)


def planned(folder: Path, given: Objective) -> dict[str, Assessment]:
    """Return the assessment of each design for an objective, by its short name."""
    cycle = Cycle(write(folder, *PARTS, imports=("http://ros/mros",)), given)
    cycle.run()
    return {each.design.rpartition("#")[2]: each for each in cycle.decision(given.name.rpartition("#")[2]).assessments}


def test_a_curve_gives_the_utility_and_a_value_keeps_its_sign(tmp_path: Path) -> None:
    found = planned(tmp_path, objective())
    assert {name: each.utility for name, each in found.items()} == pytest.approx(
        {"hasty": -0.05 + 0.64, "calm": -0.3 + 1.0, "unknown": -0.05 + 0.0}
    )
    assert [name for name, each in found.items() if each.is_selected] == ["calm"]
    assert found["hasty"].parts == pytest.approx({iri(WAIT): -0.05, iri(CARE): 0.64})


def test_a_curve_has_its_own_direction(tmp_path: Path) -> None:
    short = Curve(((0.0, 1.0), (1.0, 0.0)))
    found = planned(tmp_path, replace(objective(weights={WAIT: 1.0}), curves={iri(WAIT): short}))
    assert {name: each.utility for name, each in found.items()} == pytest.approx(
        {"hasty": 0.9, "calm": 0.4, "unknown": 0.9}
    )


def test_an_objective_gives_its_own_curve_and_the_other_qualities_keep_theirs(tmp_path: Path) -> None:
    found = planned(tmp_path, replace(objective(), curves={iri(CARE): ENOUGH}))
    assert found["hasty"].utility == pytest.approx(-0.05 + 0.8)
    assert found["calm"].utility == pytest.approx(-0.3 + 1.0)
    assert found["hasty"].is_selected


def test_a_missing_estimate_counts_with_the_lowest_utility_of_the_curve(tmp_path: Path) -> None:
    found = planned(tmp_path, replace(objective(), curves={iri(CARE): Curve(((0.0, 0.7), (0.5, 0.2), (1.0, 0.9)))}))
    assert found["unknown"].missing == (iri(CARE),)
    assert found["unknown"].parts[iri(CARE)] == pytest.approx(0.2)


def test_explanations_show_the_curve(tmp_path: Path) -> None:
    found = planned(tmp_path, objective())
    assert "  care: +0.64 of the utility, by the curve [0: 0, 0.5: 0.8, 1: 1]" in list(found["hasty"].lines())
    assert "  wait: -0.05 of the utility" in list(found["hasty"].lines())
    assert found["hasty"].as_data()["curves"] == {iri(CARE): [[0.0, 0.0], [0.5, 0.8], [1.0, 1.0]]}


def test_a_curve_of_no_quality_is_refused_with_the_nearest(tmp_path: Path) -> None:
    model = Cycle(write(tmp_path, *PARTS)).analyser.model
    (problem,) = objective_problems(model, replace(objective(), curves={iri("caer"): ENOUGH}))
    assert problem == "there is no quality 'caer'; did you mean 'care'?"


def test_a_quality_without_a_direction_may_have_a_curve_and_no_bound(tmp_path: Path) -> None:
    model = Cycle(write(tmp_path, *PARTS, individual("odd", "tomasys:QualityAttributeType"))).analyser.model
    given = replace(objective(weights={"odd": 1.0}), curves={iri("odd"): ENOUGH})
    assert objective_problems(model, given) == ()
    (problem,) = objective_problems(model, replace(objective(bounds={"odd": 1.0}), curves={iri("odd"): ENOUGH}))
    assert "the quality 'odd' has no direction" in problem


def test_objectives_that_differ_in_curves_alone_have_their_own_utilities(tmp_path: Path) -> None:
    cycle = Cycle(
        write(tmp_path, *PARTS, imports=("http://ros/mros",)),
        objective("one"),
        replace(objective("other"), curves={iri(CARE): ENOUGH}),
    )
    cycle.run()
    assert [each.design for each in cycle.plan.decisions] == [iri("calm"), iri("hasty")]
