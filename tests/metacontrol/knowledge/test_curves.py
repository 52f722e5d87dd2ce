"""Utility curves: linear between their points, the end's value outside, and refused where they are none."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import MAX_POINTS, Curve, curve_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from tests.metacontrol.owl import individual, iri, write

RAINBOW = Curve(((0.0, 0.0), (0.5, 0.8), (1.0, 1.0)))
values = st.floats(allow_nan=False, allow_infinity=False)
curves = st.dictionaries(values, st.floats(0, 1), min_size=2, max_size=8).map(
    lambda points: Curve(tuple(sorted(points.items())))
)


@pytest.mark.parametrize(("value", "utility"), [(0, 0), (0.25, 0.4), (0.5, 0.8), (0.75, 0.9), (1, 1), (-5, 0), (7, 1)])
def test_it_is_linear_between_its_points_and_keeps_the_ends_outside(value: float, utility: float) -> None:
    assert RAINBOW.utility(value) == pytest.approx(utility)


@given(curves, values)
def test_a_utility_is_between_those_of_the_points_around_it(curve: Curve, value: float) -> None:
    around = [pair for pair in pairwise(curve.points) if pair[0][0] <= value <= pair[1][0]]
    bounds = [utility for pair in around for _, utility in pair] or [curve.points[0][1], curve.points[-1][1]]
    assert min(bounds) - 1e-9 <= curve.utility(value) <= max(bounds) + 1e-9
    assert all(curve.utility(at) == utility for at, utility in curve.points)


@given(curves)
def test_its_text_means_the_same_curve(curve: Curve) -> None:
    assert curve_of(str(curve)) == curve


@pytest.mark.parametrize(
    ("points", "problem"),
    [
        (((0, 0),), "a curve has 1 points, must have 2 to 100"),
        (tuple((number, 0) for number in range(MAX_POINTS + 1)), "a curve has 101 points"),
        (((0, 0), (0, 1)), "the value 0 of a curve is behind 0: values must increase"),
        (((1, 0), (0, 1)), "the value 0 of a curve is behind 1: values must increase"),
        (((0, -0.1), (1, 1)), "the utility -0.1 of a curve must be from 0 to 1"),
        (((0, 0), (1, 1.1)), "the utility 1.1 of a curve must be from 0 to 1"),
        (((0, math.nan), (1, 1)), "the utility nan of a curve must be from 0 to 1"),
        (((0, 0), (math.inf, 1)), "the value inf of a curve must be a finite number"),
    ],
)
def test_points_that_are_no_curve_are_refused(points: tuple[tuple[float, float], ...], problem: str) -> None:
    with pytest.raises(ValueError, match="curve") as error:
        Curve(points)
    assert problem in str(error.value)


@pytest.mark.parametrize(
    "text", ["", "0", "0: 0", "0: 0; 1: 1", "0: a, 1: 1", "0: 0, 1: 1,", "1: 0, 0: 1", "0: 0, " * 9000]
)
def test_texts_that_are_no_curve_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="curve"):
        curve_of(text)


def test_a_quality_has_the_curve_of_its_file_and_needs_no_direction_with_it(tmp_path: Path) -> None:
    part = individual("q", "tomasys:QualityAttributeType", mros__qa_curve="0: 1, 2: 0", mros__qa_weight=0.5)
    quality = model_of(load([write(tmp_path, part)])).qualities[iri("q")]
    assert quality.curve == Curve(((0, 1), (2, 0)))


@pytest.mark.parametrize(
    ("value", "problem"),
    [("0: 1", "'q': qa_curve: a curve has 1 points"), (1, "qa_curve is 1.0, must be a text")],
)
def test_a_curve_of_a_file_that_is_none_is_named(tmp_path: Path, value: object, problem: str) -> None:
    path = write(tmp_path, individual("q", "tomasys:QualityAttributeType", mros__qa_curve=value))
    with pytest.raises(KnowledgeError) as error:
        model_of(load([path]))
    assert str(error.value).startswith(f"{path}:")
    assert problem in str(error.value)
