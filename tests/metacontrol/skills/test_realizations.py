"""Realizations have a skill and a context, may be the configuration of rest, and may require other skills."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Severity
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import choosable, is_rest
from tests.metacontrol.skills.texts import GOOD, at, checked, errors, found, only, place_of, realization, skill


def test_a_realization_of_an_unknown_skill_is_refused_with_the_nearest_name() -> None:
    text = GOOD + realization("b", "Component arm active", of="mov")
    one = only(text, Code.UNKNOWN_SKILL)
    assert at(one) == place_of(text, "mov {")
    assert one.message == "there is no skill 'mov'; did you mean 'move'?"


def test_a_realization_in_a_skill_belongs_to_no_other() -> None:
    assert errors(skill(realization(of="move"))) == []
    assert "leave out 'of other'" in only(skill(realization(of="other")), Code.OTHER_SKILL).message


def test_an_unknown_context_is_refused_with_the_nearest_name() -> None:
    text = skill(realization(), realization("b", "Component arm active").replace("Default", "BateryCharging"))
    assert only(text, Code.UNKNOWN_CONTEXT).message == (
        "there is no context 'BateryCharging'; did you mean 'BatteryCharging'?"
    )


@pytest.mark.parametrize("context", ["BatteryCharging", "OnChargingStation", "Night"])
def test_published_and_declared_contexts_are_known(context: str) -> None:
    other = realization("b", "Component arm active", "Quality [speed: 1]").replace("Default", context)
    assert found("Context Night\n" + skill(realization(rest="Quality [speed: 0]"), other)) == []


def test_a_skill_that_is_realized_has_a_realization_for_the_default_context() -> None:
    text = GOOD.replace("Default", "BatteryCharging")
    one = only(text, Code.NO_DEFAULT_CONTEXT)
    assert at(one) == place_of(text, "move")
    assert errors(skill()) == []


@pytest.mark.parametrize(("right", "wrong"), [("Default", "Defalt"), ("motor active", "motor actve")])
def test_a_misspelt_context_or_state_is_one_error(right: str, wrong: str) -> None:
    assert len(errors(GOOD.replace(right, wrong))) == 1


@pytest.mark.parametrize(
    ("name", "components", "rest"),
    [
        ("parked", "Component motor inactive", True),
        ("parked", "Component motor inactive, Component arm unconfigured", True),
        ("_DEFAULT_mode", "Component motor inactive", True),
        ("_Default_mode", "Component motor active", True),
        ("slow", "Component motor inactive, Component arm active", False),
    ],
)
def test_a_realization_with_nothing_active_or_named_like_the_default_is_rest(
    name: str, components: str, rest: bool
) -> None:
    text = skill(realization(), realization(name, components, "Quality [speed: 100];"))
    _, other = checked(text).skills.realizations
    assert is_rest(other) is rest
    assert errors(text) == []


def test_rest_is_never_chosen_whatever_quality_it_claims() -> None:
    text = skill(realization(), realization("parked", "Component motor inactive", "Quality [speed: 100];"))
    assert [each.name for each in choosable(checked(text).skills)] == ["go"]


def test_rest_alone_realizes_nothing() -> None:
    only(skill(realization("parked", "Component motor inactive")), Code.NO_DEFAULT_CONTEXT)


def test_rest_with_something_active_is_warned_about() -> None:
    text = skill(realization(), realization("my_default", "Component motor active.X"))
    one = only(text, Code.NEVER_CHOSEN, Severity.WARNING)
    assert "'my_default' is the configuration of rest by its name: it is never chosen" in one.message


def test_a_skill_has_one_configuration_of_rest() -> None:
    text = skill(
        realization(),
        realization("parked", "Component motor inactive"),
        realization("DEFAULT", "Component motor active"),
    )
    assert "'DEFAULT' is a second configuration of rest, next to 'parked'" in only(text, Code.REST_TWICE).message


TYPES = "Quality speed { range: 0..1 } Quality noise { better: lower, range: 0..1 }\n"
BASE = skill(realization(), name="see", qualities="speed, noise")


def requiring(requirement: str) -> str:
    """Return a skill whose realization requires something, with the skill ``see``."""
    return TYPES + BASE + skill(realization("b", "Component arm active", f"Quality [speed: 1]; {requirement}"))


def test_a_realization_requires_skills_with_bounds() -> None:
    text = requiring("requires see [speed >= 0.5, noise <= 0.2];")
    assert errors(text) == []
    (required,) = checked(text).skills.realizations[1].requirements
    assert required.skill == "see"
    assert [(each.quality, each.operator, each.value) for each in required.bounds] == [
        ("speed", ">=", 0.5),
        ("noise", "<=", 0.2),
    ]
    assert errors(requiring("requires see")) == []


@pytest.mark.parametrize(
    ("requirement", "code", "message"),
    [
        ("requires sea", Code.UNKNOWN_SKILL, "there is no skill 'sea'; did you mean 'see'?"),
        ("requires see [sped >= 1]", Code.QUALITY_NOT_LISTED, "the skill 'see' does not list the quality 'sped'"),
        ("requires see [speed >= 2]", Code.OUT_OF_RANGE, "must be from 0 to 1"),
        ("requires see [noise >= 0.2]", Code.WRONG_DIRECTION, "'noise' is better when lower: the bound must be <="),
        ("requires see [speed <= 0.2]", Code.WRONG_DIRECTION, "the bound must be >=, is <="),
        ("requires see requires see", Code.DECLARED_TWICE, "the required skill 'see' is there twice"),
    ],
)
def test_a_requirement_that_cannot_be_met_is_refused(requirement: str, code: Code, message: str) -> None:
    assert message in only(requiring(requirement), code).message


def test_skills_that_require_each_other_are_refused_once() -> None:
    def needing(name: str, needed: str) -> str:
        return skill(realization(f"do_{name}", f"Component c_{name} active", f"requires {needed}"), name=name)

    text = needing("a", "b") + needing("b", "c") + needing("c", "a")
    one = only(text, Code.REQUIREMENT_CIRCLE)
    assert one.message == "the skill 'a' requires itself: a > b > c > a"
    assert at(one) == place_of(text, "a context")
    assert only(needing("a", "a"), Code.REQUIREMENT_CIRCLE).message == "the skill 'a' requires itself: a > a"


def test_several_realizations_may_require_one_skill() -> None:
    more = realization("c", "Component leg active", "requires see;", of="move")
    assert [each for each in found(requiring("requires see") + more) if each.code is Code.REQUIREMENT_CIRCLE] == []
