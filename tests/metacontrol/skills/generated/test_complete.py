"""Generated files have all that a reasoner needs: no other file names the qualities and skills in them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, load
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Grounding, Model, Objective, Requirement
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.imports import ONTOLOGIES
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Direction, Status
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals
from regraft.adaptation_manager.planners.metacontrol.skills.reading import read_skills
from tests.metacontrol.skills.texts import only, realization, skill

LEVELS = (ONTOLOGIES / "tomasys.owl", ONTOLOGIES / "mros.owl")
QUALITIES = """\
Quality coverage { better: higher, range: 0..100, weight: 0.01 }
Quality noise { better: lower, range: 20..90 }
Context Night
"""
WAYS = (("quick", 90, 70), ("usual", 60, 50), ("gentle", 30, 30))
SENSOR = "Component sonar observable active, "


def three_of(name: str, requires: str = "") -> str:
    """Return a skill with three realizations in the context Default, and one of rest."""
    ways = [
        realization(
            f"{name}_{way}",
            f"{SENSOR if way == 'quick' else ''}Component motor active.{way.upper()}",
            f"Quality [coverage: {coverage}, noise: {noise}]; {requires}",
        )
        for way, coverage, noise in WAYS
    ]
    return skill(*ways, realization("rest", "Component motor inactive"), name=name, qualities="coverage, noise")


THREE_SKILLS = (
    QUALITIES
    + three_of("sweep", "requires follow_wall [noise <= 55]; requires map_area;")
    + three_of("map_area")
    + three_of("follow_wall")
    + realization("sweep_at_night", "Component motor active", "Quality [coverage: 10, noise: 25];", of="sweep").replace(
        "Default", "Night"
    )
)


def written(folder: Path, text: str, name: str = "cleaner") -> Path:
    """Return the file of individuals that is generated from a text of skills."""
    source = folder / f"{name}.skills"
    source.write_text(text)
    target = folder / f"{name}.owl"
    target.write_text(individuals(read_skills(source)).text)
    return target


@pytest.fixture
def base(tmp_path: Path) -> KnowledgeBase:
    return load([*LEVELS, written(tmp_path, THREE_SKILLS)])


def drive(model: Model, **bounds: float) -> Objective:
    """Return an objective of the skill that requires the two others."""
    requirements = tuple(Requirement(model.find("quality", name), bound) for name, bound in bounds.items())
    return Objective("http://me.org/objective", model.find("function", "sweep"), requirements)


def short(name: str | None) -> str:
    return "" if name is None else name.rpartition("#")[2]


def test_the_view_has_all_that_the_skills_declare(base: KnowledgeBase) -> None:
    model = model_of(base)
    assert [short(each) for each in model.functions] == ["sweep", "map_area", "follow_wall"]
    qualities = [
        (short(each.name), each.direction, each.weight, each.lowest, each.highest) for each in model.qualities.values()
    ]
    assert qualities == [("coverage", Direction.HIGHER, 0.01, 0, 100), ("noise", Direction.LOWER, 0, 20, 90)]
    assert {short(name): status for name, status in model.components.items()} == {"sonar": ComponentStatus.AVAILABLE}
    assert model.objectives == {}
    designs = {short(each.name): each for each in model.designs.values()}
    assert [name for name, each in designs.items() if each.is_rest] == [
        "sweep_rest",
        "map_area_rest",
        "follow_wall_rest",
    ]
    assert [name for name, each in designs.items() if each.context != "Default"] == ["sweep_at_night"]
    quick = designs["sweep_quick"]
    assert list(map(short, quick.components)) == ["sonar"]
    assert {short(name): value for name, value in quick.estimates.items()} == {"coverage": 90, "noise": 70}
    required = [
        (short(each.function), [(short(one.quality), one.bound) for one in each.requirements])
        for each in quick.requires
    ]
    assert required == [("follow_wall", [("noise", 55)]), ("map_area", [])]


def test_it_is_analysed_and_planned_over(base: KnowledgeBase) -> None:
    analyser = Analyser(base)
    model = analyser.model
    situation = Situation((drive(model),))

    def designs(situation: Situation) -> list[str]:
        analysis = analyser.analyse(situation)
        assert analysis.conflicts == ()
        return [short(each.design) for each in plan(model, situation, analysis, Resting(), 0.0).decisions]

    assert designs(situation) == ["sweep_quick", "follow_wall_usual", "map_area_quick"]
    assert designs(replace(situation, objectives=(drive(model, noise=40),)))[0] == "sweep_gentle"
    failed = {model.find("component", "sonar"): ComponentStatus.FAILED}
    assert designs(replace(situation, components=failed)) == ["sweep_usual", "follow_wall_usual", "map_area_usual"]
    assert designs(replace(situation, context="Night")) == ["sweep_at_night"]


def test_a_measured_violation_and_a_failed_component_are_errors(base: KnowledgeBase) -> None:
    analyser = Analyser(base)
    model = analyser.model
    objective = drive(model, noise=75)
    grounding = Grounding("http://me.org/grounding", objective.name, model.find("design", "sweep_quick"))
    loud = Situation((objective,), (grounding,), measurements={grounding.name: {model.find("quality", "noise"): 80}})
    assert analyser.analyse(loud).objectives[objective.name].status is Status.IN_ERROR_NFR
    failed = Situation((objective,), (grounding,), {model.find("component", "sonar"): ComponentStatus.FAILED})
    assert analyser.analyse(failed).objectives[objective.name].status is Status.IN_ERROR_COMPONENT


@pytest.mark.parametrize(
    ("field", "first", "second", "values"),
    [
        ("qa_direction", "better: higher", "better: lower", ('"HIGHER"', '"LOWER"')),
        ("qa_weight", "weight: 0.2", "weight: 0.5", ("0.2", "0.5")),
        ("qa_lowest", "range: 0..1", "range: 0.5..1", ("0", "0.5")),
        ("qa_highest", "range: 0..1", "range: 0..2", ("1", "2")),
    ],
)
def test_a_quality_that_two_files_declare_differently_is_an_error_that_names_both(
    tmp_path: Path, field: str, first: str, second: str, values: tuple[str, str]
) -> None:
    one = written(tmp_path, f"Quality speed {{ {first} }}", "one")
    other = written(tmp_path, f"Quality speed {{ {second} }}", "other")
    with pytest.raises(KnowledgeError) as error:
        load([*LEVELS, one, other])
    (problem,) = error.value.problems
    assert (problem.file, problem.line) == (str(other), 9)
    for part in (str(one), field, "speed", *values):
        assert part in problem.why


def test_files_that_declare_a_quality_alike_or_less_agree(tmp_path: Path) -> None:
    one = written(tmp_path, "Quality speed { range: 0..1, weight: 0.2 }", "one")
    other = written(tmp_path, "Quality speed { range: 0..1 }", "other")
    (quality,) = model_of(load([*LEVELS, one, other])).qualities.values()
    assert (quality.weight, quality.direction) == (0.2, Direction.HIGHER)


def test_a_required_skill_is_bounded_once_by_a_quality() -> None:
    text = THREE_SKILLS.replace("noise <= 55", "noise <= 55, noise <= 40", 1)
    assert "the bound of 'noise' is there twice" in only(text, Code.DECLARED_TWICE).message
