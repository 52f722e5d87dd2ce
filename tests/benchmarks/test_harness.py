"""How figures become results."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.harness import Effort, Result, Sides, compared, in_turns, percentile

samples = st.lists(st.floats(0.001, 1000.0), min_size=1, max_size=50)


@given(samples, st.floats(0.01, 1.0))
def test_a_percentile_is_a_sample_that_so_many_do_not_exceed(values: list[float], share: float) -> None:
    found = percentile(values, share)
    assert found in values
    assert sum(value <= found for value in values) >= share * len(values)


def test_a_percentile_of_nothing_is_no_number() -> None:
    assert math.isnan(percentile([], 0.5))


def test_sides_are_measured_in_turns_and_neither_always_goes_first() -> None:
    order: list[str] = []

    def side(name: str) -> list[float]:
        order.append(name)
        return [1.0]

    sides = in_turns(4, lambda: side("A"), lambda: side("B"))
    assert "".join(order) == "ABBAABBA"
    assert len(sides.ours) == len(sides.theirs) == 4


def test_the_ratio_is_that_of_rounds_not_of_totals() -> None:
    drifting = Sides([[2.0], [20.0], [200.0]], [[1.0], [10.0], [100.0]])
    result = compared("it", drifting, "s", "that", 2.0)
    assert result.ratio == 2.0
    assert result.spread == (2.0, 2.0)
    assert result.within


def test_times_faster_must_reach_its_limit() -> None:
    sides = Sides([[1.0]], [[9.0]])
    assert not compared("it", sides, "s", "that", 10.0, times_faster=True).within
    assert compared("it", sides, "s", "that", 8.0, times_faster=True).within


def test_what_could_not_be_measured_is_not_within_its_budget() -> None:
    assert Result("it", math.nan, "s", limit=1.0).within is False
    assert Result("it", 1.0, "s").within is None


def test_effort_never_falls_below_the_least_count() -> None:
    assert Effort(share=0.001).count(100, least=3) == 3
    assert Effort().count(100) == 100
