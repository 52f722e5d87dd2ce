"""Samples are compared as Mann and Whitney, Vargha and Delaney, and Holm say."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from regraft.evaluation.reports.markdown import mean_and_sd, number, table
from regraft.evaluation.statistics.samples import compare, holm, interval, summary, superiority

VALUES = st.lists(st.floats(-1e3, 1e3).map(lambda x: round(x, 3)), min_size=2, max_size=12)


@given(VALUES, VALUES)
def test_superiority_is_the_share_of_pairs_won_and_turns_around_with_the_samples(
    one: list[float], two: list[float]
) -> None:
    won = sum((a > b) + 0.5 * (a == b) for a in one for b in two) / (len(one) * len(two))
    assert superiority(one, two) == pytest.approx(won)
    assert superiority(two, one) == pytest.approx(1.0 - won)


@settings(max_examples=30, deadline=None)
@given(VALUES, VALUES)
def test_a_comparison_agrees_with_its_effect(one: list[float], two: list[float]) -> None:
    found = compare(one, two)
    assert found.u == pytest.approx(found.a12 * len(one) * len(two))
    assert 0.0 <= found.p <= 1.0
    assert found.a12_low <= found.a12_high
    assert found.difference_low <= found.difference_high
    assert found.rank_biserial == pytest.approx(2.0 * found.a12 - 1.0)


def test_complete_separation_of_25_runs_has_the_published_p() -> None:
    low, high = [float(n) for n in range(25)], [float(n) for n in range(100, 125)]
    assert compare(high, low).p == pytest.approx(7.07e-10, rel=0.01)
    assert compare(low, high).p == pytest.approx(1.0)
    assert compare(high, low).a12 == 1.0


def test_equal_samples_are_not_told_apart() -> None:
    assert compare([1.0] * 5, [1.0] * 5).p == 1.0
    assert compare([1.0] * 5, [1.0] * 5).a12 == 0.5


def test_a_sample_of_one_is_refused() -> None:
    with pytest.raises(ValueError, match="at least 2 values"):
        compare([1.0], [2.0, 3.0])


@given(st.dictionaries(st.text(max_size=3), st.floats(0.0, 1.0), max_size=8))
def test_corrected_p_values_are_never_less_and_keep_their_order(p_values: dict[str, float]) -> None:
    corrected = holm(p_values)
    assert list(corrected) == list(p_values)
    assert all(p <= corrected[name] <= 1.0 for name, p in p_values.items())
    ranked = sorted(p_values, key=lambda name: p_values[name])
    assert [corrected[name] for name in ranked] == sorted(corrected.values())


@given(st.lists(st.floats(-1e6, 1e6), max_size=14))
@example([0.0, 0.0, 1e-190])
def test_what_cannot_be_said_of_a_sample_is_nan(values: list[float]) -> None:
    found = summary([*values, math.nan])
    assert found.size == len(values)
    assert math.isnan(found.mean) is (not values)
    assert math.isnan(found.sd) is (len(values) < 2)
    low, high = interval(values)
    assert math.isnan(low) is (len(values) < 10)
    if len(values) >= 10:
        assert min(values) - 1e-6 <= low <= high <= max(values) + 1e-6


def test_tables_are_whole_and_numbers_short() -> None:
    assert table(["a", "b"], [["1", "2"]]) == "| a | b |\n|---|---|\n| 1 | 2 |\n"
    with pytest.raises(ValueError, match="must have 2"):
        table(["a", "b"], [["1"]])
    assert mean_and_sd(0.001328, 0.000388) == "0.00133 ± 0.00039"
    assert mean_and_sd(math.nan, 1.0) == "–"
    assert number(123456.0) == "123456"
