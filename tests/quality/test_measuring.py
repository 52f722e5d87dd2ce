"""Numbers: degrees, means and integrals over time, names."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.keys import SYSTEM_NAME
from regraft.services.bt_executor.quality.naming import bus_names, key_safe
from regraft.services.bt_executor.quality.over_time import Integral, MeanOverTime, Unknown
from regraft.services.bt_executor.quality.satisfaction_degree import RELATIONS, at_least, at_most, close_to

numbers = st.floats(-1e6, 1e6)
tolerances = st.floats(1e-3, 1e3)


def test_a_mean_is_over_time_and_not_over_ticks() -> None:
    mean = MeanOverTime()
    for time in (0.0, 0.1, 0.2, 0.3):
        mean.hold(1.0, time)
    mean.hold(3.0, 1.0)
    mean.hold(None, 4.0)
    assert mean.value == pytest.approx((1.0 * 1.0 + 3.0 * 3.0) / 4.0)


def test_a_mean_leaves_out_the_time_for_which_nothing_is_known() -> None:
    mean = MeanOverTime()
    mean.hold(2.0, 0.0)
    mean.hold(None, 1.0)
    mean.hold(4.0, 9.0)
    mean.hold(None, 10.0)
    assert mean.value == 3.0


def test_a_value_that_has_held_for_no_time_stands_for_itself() -> None:
    mean = MeanOverTime()
    assert mean.value is None
    mean.hold(2.0, 5.0)
    assert mean.value == 2.0


@given(st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.01, 5.0)), min_size=1), st.integers(2, 5))
def test_a_mean_does_not_depend_on_how_often_one_looks(held: list[tuple[float, float]], looks: int) -> None:
    once, often, time = MeanOverTime(), MeanOverTime(), 0.0
    for value, seconds in held:
        once.hold(value, time)
        for look in range(looks):
            often.hold(value, time + seconds * look / looks)
        time += seconds
    once.hold(None, time)
    often.hold(None, time)
    assert once.value == pytest.approx(often.value)
    values = [value for value, _ in held]
    assert min(values) - 1e-9 <= (once.value or 0.0) <= max(values) + 1e-9


def test_an_integral_is_over_seconds_and_a_value_holds_until_the_next() -> None:
    energy = Integral(10.0)
    assert energy.add(5.0, 11.0) == 5.0
    assert energy.add(7.0, 13.0) == 15.0
    assert energy.add(7.0, 14.0) == 22.0


def test_an_integral_with_a_gap_that_is_too_long_stays_unknown() -> None:
    energy = Integral(0.0, longest_gap=1.0)
    energy.add(5.0, 1.0)
    with pytest.raises(Unknown, match="gap of more than 1 s"):
        energy.add(5.0, 2.5)
    with pytest.raises(Unknown):
        energy.add(5.0, 2.6)


@pytest.mark.parametrize(
    ("degree", "value", "expected"),
    [
        (at_least, 0.1, 1.0),
        (at_least, 0.0999, 0.0),
        (at_most, 0.1, 1.0),
        (at_most, 0.1001, 0.0),
    ],
)
def test_a_bound_is_kept_on_the_bound_and_on_the_right_side_of_it(
    degree: object, value: float, expected: float
) -> None:
    assert callable(degree)
    assert degree(value, 0.1, 0.0) == expected


@pytest.mark.parametrize(
    ("speed", "degree"), [(0.26, 1.0), (0.18, 0.5), (0.34, 0.5), (0.22, 0.75), (0.10, 0.0), (0.0, 0.0)]
)
def test_close_to_is_one_at_the_target_and_one_half_at_the_tolerance(speed: float, degree: float) -> None:
    assert close_to(speed, 0.26, 0.08) == pytest.approx(degree, abs=1e-9)


@given(numbers, numbers, tolerances)
def test_degrees_are_ratios_and_one_half_where_the_bound_is(value: float, bound: float, within: float) -> None:
    for relation in (at_least, at_most, close_to):
        assert 0.0 <= relation(value, bound, within) <= 1.0
    assert at_least(bound, bound, within) == at_most(bound, bound, within) == 0.5
    assert close_to(bound, bound, within) == 1.0
    assert at_least(value, bound, within) + at_most(value, bound, within) == pytest.approx(1.0)


@given(numbers, numbers, numbers, tolerances)
def test_degrees_are_monotonous(one: float, other: float, bound: float, within: float) -> None:
    low, high = sorted((one, other))
    assert at_least(low, bound, within) <= at_least(high, bound, within)
    assert at_most(low, bound, within) >= at_most(high, bound, within)


def test_a_wish_without_tolerance_takes_its_number_as_its_scale() -> None:
    few = next(relation for relation in RELATIONS if relation.port == "as_few_as_possible")
    assert [few.holds_to(value, 40.0, None) for value in (0.0, 40.0, 80.0, 100.0)] == [1.0, 0.5, 0.0, 0.0]
    with pytest.raises(ValueError, match="tolerance"):
        few.holds_to(1.0, 0.0, None)
    with pytest.raises(ValueError, match="does not work on nan"):
        few.holds_to(math.nan, 1.0, None)


@given(st.text(min_size=1, max_size=200))
def test_any_name_becomes_one_that_can_stand_in_a_key(name: str) -> None:
    assert SYSTEM_NAME.fullmatch(key_safe(name))


def test_a_name_is_kept_and_only_those_that_share_one_are_told_apart() -> None:
    names = [("MoveSafely", "MoveSafely"), ("Save", "A/Save"), ("Save", "B/Save"), ("so so", "x/so so")]
    assert bus_names(names) == ["MoveSafely", "A-Save", "B-Save", "so_so"]
    assert bus_names([("Save", "Save")] * 3) == ["Save", "Save-2", "Save-3"]


@given(st.lists(st.tuples(st.sampled_from(["a", "a b", "a_b", "a-2"]), st.sampled_from(["a", "x/a", "a-2", "a b"]))))
def test_names_on_the_bus_are_unique_and_fit(named: list[tuple[str, str]]) -> None:
    names = bus_names(named)
    assert len(set(names)) == len(names) == len(named)
    assert all(SYSTEM_NAME.fullmatch(name) for name in names)
    assert names == bus_names(named)
