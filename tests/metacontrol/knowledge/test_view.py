"""The typed view has what a reasoner needs; names are exact, and what has no meaning is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import (
    Model,
    Objective,
    Requirement,
    objective_problems,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Direction
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from tests.metacontrol.owl import (
    BATTERY,
    ENERGY,
    LASER,
    NAVIGATE,
    PERFORMANCE,
    REALIZATIONS,
    SAFETY,
    design,
    individual,
    iri,
    published_designs,
    quality,
    write,
)


def model(folder: Path, *parts: str) -> Model:
    """Return the typed view of some parts."""
    return model_of(load([write(folder, *parts)]))


def test_designs_have_their_function_estimates_and_components(tmp_path: Path) -> None:
    found = model(tmp_path, published_designs())
    assert [name.partition("#")[2] for name in found.designs] == list(REALIZATIONS), "in the order of the file"
    normal = found.designs[iri("normal")]
    assert normal.function == iri(NAVIGATE)
    assert normal.estimates == {iri(SAFETY): 0.8, iri(PERFORMANCE): 0.7, iri(ENERGY): 0.5}
    assert set(normal.components) == {iri(LASER), iri(BATTERY)}
    assert found.designs[iri("slow")].context == "Default"


def test_the_direction_of_a_quality_is_data_of_its_type(tmp_path: Path) -> None:
    found = model(tmp_path, quality("noise", "LOWER", 0.5), quality("light", "HIGHER"))
    assert found.qualities[iri("noise")].direction is Direction.LOWER
    assert found.qualities[iri("noise")].weight == 0.5
    assert found.qualities[iri("noise")].worst == 1.0
    assert found.qualities[iri("light")].worst == 0.0
    assert found.qualities[iri("light")].meets(0.5, 0.5)
    assert not found.qualities[iri("noise")].meets(0.51, 0.5)


def test_objectives_groundings_and_requirements_of_files_are_there(tmp_path: Path) -> None:
    found = model(
        tmp_path,
        published_designs(),
        individual("o", "tomasys:Objective", tomasys__typeF=f">{NAVIGATE}", tomasys__hasNFR=">n", mros__o_priority=2),
        individual("n", "tomasys:QAvalue", tomasys__isQAtype=f">{SAFETY}", tomasys__hasValue=0.5),
        individual("fg", "tomasys:FunctionGrounding", tomasys__typeFD=">slow", tomasys__solvesO=">o"),
        design("composed", NAVIGATE, {}, mros__fd_requiresO=">sub", mros__fd_context="Dark"),
        individual("sub", "tomasys:Objective", tomasys__typeF=">nav:to_recharge"),
        design("rest", NAVIGATE, {SAFETY: 1.0}, mros__fd_is_rest=True),
    )
    assert found.objectives[iri("o")] == Objective(
        iri("o"), iri(NAVIGATE), (Requirement(iri(SAFETY), 0.5),), priority=2.0
    )
    assert set(found.objectives) == {iri("o")}, "an objective that a design requires is no client's"
    assert found.groundings[iri("fg")].design == iri("slow")
    assert [each.function for each in found.designs[iri("composed")].requires] == [iri("nav:to_recharge")]
    assert [each.name for each in found.designs_of(iri(NAVIGATE), "Dark")] == [iri("composed")]
    default = [each.name for each in found.designs_of(iri(NAVIGATE), "Default")]
    assert default == [iri(name) for name in REALIZATIONS], "without the rest configuration and the other context"
    assert [each.name for each in found.designs_of(iri(NAVIGATE), "Elsewhere")] == default


def test_components_in_roles_are_required(tmp_path: Path) -> None:
    found = model(
        tmp_path,
        design("d", NAVIGATE, {}, tomasys__roles=">r"),
        individual("r", "tomasys:Role", tomasys__roleDef=">spec"),
        individual("spec", "tomasys:ComponentSpecification"),
    )
    assert found.designs[iri("d")].components == (iri("spec"),)
    assert iri("spec") in found.components, "a specification is a component, by its superclass"


def test_names_match_exactly(tmp_path: Path) -> None:
    found = model(tmp_path, design("f_a", NAVIGATE, {}), design("xf_a", NAVIGATE, {}))
    assert found.find("design", "f_a") == iri("f_a")
    assert found.find("design", iri("xf_a")) == iri("xf_a")
    assert found.find("component", "battery") == iri(BATTERY)
    with pytest.raises(ValueError, match="there is no design 'f'; there are: f_a, xf_a"):
        found.find("design", "f")
    with pytest.raises(ValueError, match="there is no design '_a'"):
        found.find("design", "_a")


def test_a_short_name_that_means_several_is_refused(tmp_path: Path) -> None:
    found = model(tmp_path, individual("battery", "tomasys:Component"))
    with pytest.raises(ValueError, match="the component 'battery' is one of several: http://ros/application#battery, "):
        found.find("component", "battery")


ESTIMATED = individual("d", tomasys__hasQAestimation=">q")


@pytest.mark.parametrize(
    ("part", "expected"),
    [
        (individual("thing", "tomasys:FunctionDesign"), "has no solvesF, must name the function that it solves"),
        (individual("thing", "tomasys:Objective"), "has no typeF, must name the function that it is for"),
        (individual("thing", "tomasys:FunctionGrounding"), "has no typeFD, must have 1"),
        (design("d", NAVIGATE, {}) + ESTIMATED, "'q': has no isQAtype, must have 1"),
        (
            design("d", NAVIGATE, {}) + ESTIMATED + individual("q", tomasys__isQAtype=f">{SAFETY}"),
            "'q': has no hasValue, must have 1 number",
        ),
        (quality("thing", "LOWER", -1), "the weight is -1, must be at least 0"),
        (individual("thing", "tomasys:QualityAttributeType", mros__qa_weight=1), "has a weight and no qa_direction"),
        (
            individual("thing", "tomasys:QualityAttributeType", mros__qa_lowest=2, mros__qa_highest=1),
            "the lowest value is 2, must be at most the highest, 1",
        ),
    ],
)
def test_what_has_no_meaning_is_named_with_its_place(tmp_path: Path, part: str, expected: str) -> None:
    path = write(tmp_path, part)
    with pytest.raises(KnowledgeError) as caught:
        model_of(load([path]))
    assert str(caught.value).startswith(f"{path}:")
    assert expected in str(caught.value)


def test_a_quality_with_two_estimates_is_refused_unless_they_are_equal(tmp_path: Path) -> None:
    second = individual("more", "tomasys:QAvalue", tomasys__isQAtype=f">{SAFETY}", tomasys__hasValue=0.8)
    link = individual("d", tomasys__hasQAestimation=">more")
    assert model(tmp_path, design("d", NAVIGATE, {SAFETY: 0.8}), second, link).designs[iri("d")].estimates == {
        iri(SAFETY): 0.8
    }
    with pytest.raises(KnowledgeError, match=r"'d': the quality 'safety' has the values .*, must have 1"):
        model(tmp_path, design("d", NAVIGATE, {SAFETY: 0.7}), second, link)


@pytest.mark.parametrize(
    ("objective", "expected"),
    [
        (Objective("o", iri("nav:to_navigat")), "there is no function 'to_navigat'; did you mean 'to_navigate'?"),
        (Objective("o", iri(NAVIGATE), (Requirement(iri("mros:safty"), 1),)), "there is no quality 'safty'; did you"),
        (Objective("o", iri(NAVIGATE), (Requirement(iri("plain"), 1),)), "the quality 'plain' has no direction"),
        (Objective("o", iri(NAVIGATE), (Requirement(iri(SAFETY), float("nan")),)), "the bound of 'safety' is nan"),
        (Objective("o", iri(NAVIGATE), (Requirement(iri(SAFETY), "high"),)), "is 'high', must be a number"),  # type: ignore[arg-type]
        (
            Objective("o", iri(NAVIGATE), weights={iri(SAFETY): -1}),
            "the weight of 'safety' is -1, must be a number from 0",
        ),
        (Objective("o", iri(NAVIGATE), design=iri("slo")), "there is no design 'slo'; did you mean 'slow'?"),
        (Objective("o", iri("nav:to_recharge"), design=iri("slow")), "the design 'slow' solves 'to_navigate'"),
    ],
)
def test_an_objective_without_a_meaning_is_refused_with_the_reason(
    tmp_path: Path, objective: Objective, expected: str
) -> None:
    found = model(tmp_path, published_designs(), individual("plain", "tomasys:QualityAttributeType"))
    (problem,) = objective_problems(found, objective)
    assert problem.startswith(expected) or expected in problem
    assert objective_problems(found, Objective("o", iri(NAVIGATE), (Requirement(iri(SAFETY), 0.5),))) == ()
