"""Qualities are an open set: skills list them, types declare them, realizations estimate them."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Severity
from regraft.adaptation_manager.planners.metacontrol.skills.knowledge import knowledge_of
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Better
from tests.metacontrol.skills.texts import GOOD, at, checked, errors, found, only, place_of, realization, skill

TYPE = 'Quality speed { better: lower, range: 0..1, measured: "motor.speed / 2", weight: 0.2 }\n'


def test_any_name_is_a_quality_where_none_is_declared() -> None:
    assert errors(GOOD) == []
    assert errors(GOOD.replace("speed", "quietness")) == []


def test_a_quality_type_has_a_direction_a_range_an_expression_and_a_weight() -> None:
    quality = checked(TYPE + GOOD).skills.quality("speed")
    assert found(TYPE + GOOD) == []
    assert quality is not None
    assert (quality.better, quality.low, quality.high) == (Better.LOWER, 0.0, 1.0)
    assert (quality.measured, quality.weight) == ("motor.speed / 2", 0.2)


def test_a_quality_type_may_leave_out_everything() -> None:
    quality = checked("Quality speed").skills.quality("speed")
    assert quality is not None
    assert (quality.better, quality.low, quality.measured, quality.weight) == (Better.HIGHER, None, None, None)


def test_a_quality_that_the_skill_does_not_list_is_refused() -> None:
    text = GOOD.replace("[speed: 0.5]", "[sped: 0.5]")
    one = only(text, Code.QUALITY_NOT_LISTED)
    assert at(one) == place_of(text, "sped: 0.5")
    assert one.message == "the skill 'move' does not list the quality 'sped'; did you mean 'speed'?"


def test_a_listed_quality_that_is_not_declared_is_refused_where_others_are() -> None:
    one = only(TYPE + GOOD.replace("[speed]", "[speed, safty]") + "Quality safety", Code.UNKNOWN_QUALITY)
    assert one.message == "there is no quality 'safty'; did you mean 'safety'?"


def test_a_listed_quality_without_an_estimate_is_warned_about() -> None:
    one = only(skill(realization()), Code.NO_ESTIMATE, Severity.WARNING)
    assert one.message == "'go' has no estimate of: speed"


def test_a_quality_given_twice_with_different_values_is_refused() -> None:
    text = GOOD.replace("speed: 0.5", "speed: 0.5, speed: 0.6")
    one = only(text, Code.QUALITY_TWICE)
    assert at(one) == place_of(text, "speed: 0.6")
    assert "is 0.6 here and 0.5 in f.skills:" in one.message


def test_a_quality_given_twice_with_equal_values_is_warned_about() -> None:
    only(GOOD.replace("speed: 0.5", "speed: 0.5, speed: 0.50"), Code.QUALITY_TWICE, Severity.WARNING)


def test_a_quality_may_be_given_once_for_each_environment() -> None:
    assert found(GOOD.replace("speed: 0.5", "speed: 0.5, speed: 0.2 <environment e {a: 1}>")) == []


@pytest.mark.parametrize("value", ["1.1", "-0.1"])
def test_an_estimate_out_of_the_range_is_refused(value: str) -> None:
    one = only(TYPE + GOOD.replace("0.5", value), Code.OUT_OF_RANGE)
    assert one.message == f"speed: {value} is out of the quality's range: must be from 0 to 1"


@pytest.mark.parametrize("value", ["0", "1", "1.0"])
def test_the_ends_of_the_range_belong_to_it(value: str) -> None:
    assert found(TYPE + GOOD.replace("0.5", value)) == []


@pytest.mark.parametrize(
    ("field", "code", "message"),
    [
        ("range: 1..0", Code.BAD_RANGE, "the range of 'a' is empty"),
        ("range: 0..1e999", Code.BAD_RANGE, "must be LOW..HIGH"),
        ("weight: -1", Code.BAD_WEIGHT, "must be 0 or more"),
        ("weight: 1e999", Code.BAD_WEIGHT, "and finite"),
        ('measured: "a +"', Code.BAD_EXPRESSION, "is no expression"),
        ("measured: \"open('x')\"", Code.BAD_EXPRESSION, "is no function"),
        ("measured: \"'text'\"", Code.BAD_EXPRESSION, "must be a number"),
        (f'measured: "{"(" * 300}a{")" * 300}"', Code.BAD_EXPRESSION, ""),
        (f'measured: "{"-" * 200}a"', Code.BAD_EXPRESSION, "nested more than 140 deep"),
    ],
)
def test_a_field_that_cannot_be_is_refused_at_its_place(field: str, code: Code, message: str) -> None:
    text = f"Quality a {{\n  {field} }}"
    one = only(text, code)
    assert at(one) == (2, 3)
    assert message in one.message


def test_numbers_beyond_all_bounds_are_refused() -> None:
    assert only(GOOD.replace("0.5", "1e999"), Code.BAD_NUMBER).message.startswith("speed: is out of range")
    assert only(GOOD.replace("0.5", "9" * 5000), Code.BAD_NUMBER)


def test_a_curve_is_read_and_generated() -> None:
    text = "Quality speed { curve: [0: 0, 0.5: 0.8, 1: 1], weight: 1 }\n" + GOOD
    assert errors(text) == []
    (quality,) = checked(text).skills.qualities
    assert quality.curve == ((0.0, 0.0), (0.5, 0.8), (1.0, 1.0))
    model = model_of(knowledge_of(checked(text).skills))
    assert [each.curve for each in model.qualities.values()] == [Curve(((0, 0), (0.5, 0.8), (1, 1)))]


@pytest.mark.parametrize(
    ("points", "problem"),
    [
        ("0: 0", "a curve has 1 points, must have 2 to 100"),
        ("0: 0, 0: 1", "values must increase"),
        ("0: 0, 1: 2", "the utility 2 of a curve must be from 0 to 1"),
        ("0: 0, 1e999: 1", "must be a finite number"),
    ],
)
def test_points_that_are_no_curve_are_reported(points: str, problem: str) -> None:
    text = f"Quality speed {{ curve: [{points}] }}\n{GOOD}"
    found = only(text, Code.BAD_CURVE)
    assert at(found) == place_of(text, "curve")
    assert found.message.startswith("the curve of 'speed': ")
    assert problem in found.message
