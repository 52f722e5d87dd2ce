"""The qualities of driving from 0 to 1, by hand."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.services.navigator.normalized_qualities import (
    AMPLE,
    RecentWay,
    energy,
    performance,
    safety,
    stopping_distance,
)

speeds, gaps = st.floats(0.0, 2.0), st.floats(0.0, 10.0)


def test_a_robot_stops_after_its_reaction_and_its_braking() -> None:
    assert stopping_distance(0.5, 1.0) == pytest.approx(0.5 * 0.25 + 0.5**2 / 2.0)
    assert stopping_distance(-0.5, 1.0) == stopping_distance(0.5, 1.0)
    assert stopping_distance(0.0, 1.0) == 0.0


def test_safety_is_what_is_left_of_the_gap_when_the_robot_has_stopped() -> None:
    assert safety(0.3, 0.4, 1.0) == pytest.approx((0.3 - 0.18) / 0.25)
    assert safety(0.2, 0.5, 1.0) == 0.0
    assert safety(5.0, 0.5, 1.0) == 1.0
    assert safety(AMPLE, 0.0, 1.0) == 1.0


@given(gaps, gaps, speeds, speeds)
def test_more_room_is_no_less_safe_and_more_speed_no_safer(near: float, far: float, slow: float, fast: float) -> None:
    near, far = sorted((near, far))
    slow, fast = sorted((slow, fast))
    assert 0.0 <= safety(near, fast, 1.0) <= safety(far, fast, 1.0) <= 1.0
    assert safety(near, fast, 1.0) <= safety(near, slow, 1.0)


def test_performance_is_the_best_possible_time_over_the_time_taken() -> None:
    assert performance(10.0, 40.0, 0.5) == 0.5
    assert performance(10.0, 20.0, 0.5) == 1.0
    assert performance(0.0, 20.0, 0.5) == 0.0
    assert performance(0.0, 0.0, 0.5) == 1.0


def test_energy_is_a_share_of_the_largest_power() -> None:
    assert [energy(power, 25.0) for power in (-1.0, 0.0, 12.5, 40.0)] == [0.0, 0.0, 0.5, 1.0]


def test_a_recent_way_counts_ten_seconds_and_forgets_the_drive_before() -> None:
    way = RecentWay()
    assert way.performance(0.5) is None
    for tick in range(401):
        way.take(tick * 0.05, 0.5 if tick < 200 else 0.25)
    assert way.performance(0.5) == pytest.approx(0.5, abs=0.01)
    way.rest(20.5)
    assert way.performance(0.5) == pytest.approx(0.5, abs=0.01), "a pause between two motions is part of the drive"
    way.rest(21.5)
    assert way.performance(0.5) is None
