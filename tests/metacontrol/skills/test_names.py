"""Names are declared once, and differ in more than case."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Severity
from tests.metacontrol.skills.texts import GOOD, at, errors, found, only, place_of, realization, skill

TWICE = {
    "skill": (skill() + skill(), "move", 2),
    "quality": ("Quality a Quality a", "a", 4),
    "context": ("Context a Context a", "a", 2),
    "component": ("Component a { Configuration active } Component a { Configuration active }", "a {", 2),
    "component of a realization": (
        skill(realization(components="Component a active, Component a inactive")),
        "a inactive",
        1,
    ),
    "realization": (skill(realization("x"), realization("x", components="Component b active")), "x {", 2),
    "quality that is listed": (skill(qualities="a, a"), "a]", 1),
    "field of a quality": ("Quality a { weight: 1, weight: 2 }", "weight", 2),
    "input": ("Skill a { quality attributes [b] input { x: int, x: int } }", "x", 2),
    "output named like an input": ("Skill a { quality attributes [b] input { x: int } output { x: int } }", "x", 2),
    "result": ("Skill a { quality attributes [b] result { error: 1, error: 2 } }", "error", 2),
    "parameter": (skill(realization(components="Component a { Configuration active { p: 1, p: 1 } }")), "p: 1", 2),
    "configuration": (
        "Component a { Configuration active.X { p: 1 }, Configuration active.X { p: 1 } }",
        "active",
        2,
    ),
}


@pytest.mark.parametrize("kind", TWICE)
def test_a_name_that_is_declared_twice_is_refused_where_it_is_again(kind: str) -> None:
    text, piece, number = TWICE[kind]
    one = only(text, Code.DECLARED_TWICE)
    assert at(one) == place_of(text, piece, number)
    assert "is there twice, first in f.skills:1" in one.message or "first in f.skills:2" in one.message


def test_two_skills_may_have_realizations_of_one_name() -> None:
    assert errors(skill(realization(), name="a") + skill(realization(), name="b")) == []


@pytest.mark.parametrize(
    "text",
    [
        skill() + skill(name="Move"),
        "Quality a Quality A",
        skill(qualities="a, A"),
        "Context default",
        skill(realization("x"), realization("X", components="Component motor inactive, Component b active")),
        skill(realization(components="Component a active, Component A active")),
        "Component a { Configuration active.X { p: 1 }, Configuration active.x { p: 2 } }",
        "Component a { Configuration active.X { p: 1 }, Configuration active.Y { P: 2 } }",
    ],
    ids=range(8),
)
def test_names_that_differ_in_case_only_are_warned_about(text: str) -> None:
    assert "in case only" in only(text, Code.CASE_DIFFERS, Severity.WARNING).message


def test_a_skill_that_is_named_like_a_component_is_refused() -> None:
    assert "is also a component" in only(GOOD.replace("move", "motor"), Code.SAME_NAME).message


def test_all_errors_come_at_once_in_the_order_of_the_file() -> None:
    text = skill(realization(rest="Quality [sped: 0.5];"), qualities="speed, speed") + skill(
        realization("go", rest="Quality [speed: 1];").replace("Default", "Defalt"), name="other"
    )
    every = found(text)
    assert [each.code for each in every if each.severity is Severity.ERROR] == [
        Code.DECLARED_TWICE,
        Code.QUALITY_NOT_LISTED,
        Code.UNKNOWN_CONTEXT,
    ]
    assert [at(each) for each in every] == sorted(at(each) for each in every)
