"""Configurations are lifecycle states or modes of active components, and inference can distinguish them."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Severity
from tests.metacontrol.skills.texts import GOOD, at, checked, errors, found, only, place_of, realization, skill


@pytest.mark.parametrize("name", ["active", "active.X", "active.DEFAULT"])
def test_active_and_its_modes_are_configurations(name: str) -> None:
    assert found(GOOD.replace("motor active", f"motor {name}")) == []


@pytest.mark.parametrize("name", ["inactive", "unconfigured"])
def test_the_other_states_in_which_components_stay_are_configurations(name: str) -> None:
    assert found(GOOD.replace("motor active", f"motor active, Component arm {name}")) == []


@pytest.mark.parametrize(
    ("name", "hint"),
    [("actve", "did you mean 'active'?"), ("inactiv", "'inactive'"), ("on", "there are:"), ("configured", "'")],
)
def test_a_configuration_that_is_no_state_is_refused(name: str, hint: str) -> None:
    text = GOOD.replace("motor active", f"motor {{ Configuration active, Configuration {name} }}")
    one = only(text, Code.NO_STATE)
    assert at(one) == place_of(text, f"{name} }}")
    assert "is no lifecycle state" in one.message
    assert hint in one.message


def test_only_active_has_modes() -> None:
    text = GOOD.replace("motor active", "motor active, Component arm inactive.X")
    assert "must be 'inactive' or 'active.X'" in only(text, Code.NO_STATE).message


@pytest.mark.parametrize(
    "state",
    ["finalized", "configuring", "cleaningup", "shuttingdown", "activating", "deactivating", "errorprocessing"],
)
def test_a_state_in_which_no_component_stays_makes_a_realization_unrealisable(state: str) -> None:
    text = skill(realization(), realization("other", f"Component motor active, Component arm {state}"))
    one = only(text, Code.UNREALISABLE, Severity.WARNING)
    assert f"no component stays in {state!r}: 'other' is unrealisable" in one.message
    assert errors(text) == []


def test_one_configuration_with_two_sets_of_parameters_is_refused() -> None:
    text = skill(
        realization("a", "Component motor { Configuration active.X { p: 1, q: 2 } }"),
        realization("b", "Component motor { Configuration active.X { p: 1, q: 3 } }"),
    )
    one = only(text, Code.DIFFERENT_PARAMETERS)
    assert at(one) == place_of(text, "active.X", 2)
    assert one.message == "'active.X' of 'motor' has other parameters than 'active.X' in f.skills:2:49: q"


@pytest.mark.parametrize(("one", "other"), [("1", "1.0"), ("1", "true"), ('"1"', "1")])
def test_values_of_different_types_are_different(one: str, other: str) -> None:
    text = skill(
        realization("a", f"Component motor {{ Configuration active.X {{ p: {one} }} }}"),
        realization("b", f"Component motor {{ Configuration active.X {{ p: {other} }} }}"),
    )
    only(text, Code.DIFFERENT_PARAMETERS)


def test_one_configuration_may_have_its_parameters_in_another_order() -> None:
    text = skill(
        realization("a", "Component motor { Configuration active.X { p: 1, q: 0.2 } }"),
        realization("b", "Component motor { Configuration active.X { q: 0.20, p: 1 } }, Component arm active"),
    )
    assert errors(text) == []


def test_bare_active_and_the_default_are_one_configuration() -> None:
    text = skill(
        realization("a", "Component motor { Configuration active { p: 1 } }"),
        realization("b", "Component motor { Configuration active.DEFAULT { p: 2 } }"),
    )
    assert (
        "'active.DEFAULT' of 'motor' has other parameters than 'active'"
        in only(text, Code.DIFFERENT_PARAMETERS).message
    )


def test_a_configuration_is_declared_once_and_named_in_realizations() -> None:
    text = "Component motor observable { Configuration active.X { p: 1 }, Configuration active.Y { p: 2 } }\n" + skill(
        realization("a", "Component motor active.X", "Quality [speed: 1]"),
        realization("b", "Component motor { Configuration active.Y }", "Quality [speed: 2]"),
    )
    assert found(text) == []
    assert checked(text).skills.components[0].observable


def test_several_configurations_of_a_component_are_warned_about() -> None:
    text = GOOD.replace("motor active", "motor { Configuration inactive, Configuration active.X }")
    one = only(text, Code.SEVERAL_CONFIGURATIONS, Severity.WARNING)
    assert one.message == "'motor' has several configurations here: 'active.X' is used"


def test_parameters_of_what_is_not_active_are_warned_about() -> None:
    text = GOOD.replace("motor active", "motor active, Component arm { Configuration inactive { p: 1 } }")
    only(text, Code.PARAMETERS_IGNORED, Severity.WARNING)


def test_parameters_without_a_value_or_with_two_are_warned_about() -> None:
    text = GOOD.replace("motor active", 'motor { Configuration active { p: , q: "a" 3 } }')
    assert [each.message for each in found(text, Code.VALUE_IGNORED)] == [
        "'p' has no value: it is not set",
        "'q' has a text and a number: the number 3 is ignored",
    ]


@pytest.mark.parametrize("value", ["1e999", "9223372036854775808", "9" * 5000, "-1e400"])
def test_numbers_that_no_parameter_can_have_are_refused(value: str) -> None:
    only(GOOD.replace("motor active", f"motor {{ Configuration active {{ p: {value} }} }}"), Code.BAD_NUMBER)


MODES = (
    "Component m { Configuration active.A { p: 1 }, Configuration active.B { p: %s }, Configuration active { p: 0 } }"
)


def test_configurations_with_equal_parameters_are_warned_about() -> None:
    one = only(MODES % "1", Code.INDISTINGUISHABLE, Severity.WARNING)
    assert one.message == "inference cannot distinguish 'B' of 'm' from 'A': their parameters are equal"


def test_a_mistyped_mode_without_parameters_has_the_nearest_one() -> None:
    text = "Component m { Configuration active.SLOW { p: 1 }, Configuration active { p: 0 } }"
    wrong = skill(realization(components="Component m active.SLWO"))
    one = only(text + wrong, Code.INDISTINGUISHABLE, Severity.WARNING)
    assert one.message.endswith("are equal; 'SLWO' has none of its own: did you mean 'SLOW'?")


@pytest.mark.parametrize("value", ["2", "1.0", "true", '"1"'])
def test_configurations_with_different_values_or_types_are_distinct(value: str) -> None:
    assert [each for each in found(MODES % value) if "'B'" in each.message] == []


def test_a_mode_that_sets_what_the_default_has_is_the_default() -> None:
    text = "Component m { Configuration active { p: 1 }, Configuration active.A { p: 1 } }"
    assert "'A' of 'm' from '__DEFAULT__'" in only(text, Code.INDISTINGUISHABLE, Severity.WARNING).message


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        ("Component m active", "Component m active.DEFAULT", True),
        ("Component m active", "Component m active, Component n inactive", True),
        ("Component m active, Component n active", "Component n active, Component m active", True),
        ("Component m active", "Component m active, Component n unconfigured", False),
        ("Component m active", "Component n active", False),
    ],
)
def test_realizations_with_equal_states_and_parameters_are_warned_about(one: str, other: str, alike: bool) -> None:
    warned = found(skill(realization("a", one), realization("b", other)), Code.INDISTINGUISHABLE)
    assert len(warned) == alike
    assert all("inference cannot distinguish 'b' from 'a' in f.skills:2:13" in each.message for each in warned)


def test_realizations_of_different_skills_may_be_alike() -> None:
    assert found(skill(realization(), name="a") + skill(realization(), name="b"), Code.INDISTINGUISHABLE) == []
