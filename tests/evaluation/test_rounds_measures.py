"""The utilities of FROG's rounds, on both sides of every threshold, by either definition."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.evaluation.reactions import Reactions
from regraft.evaluation.rows import Rows, written
from regraft.services.power_model import PICTURE_ENERGY, motion_power
from regraft.stacks.frog.studies import rounds_measures as measures
from regraft.stacks.frog.studies.arms.columns import COLUMNS
from regraft.stacks.frog.studies.blocking import SECONDS, SHARE, blocked
from regraft.stacks.frog.studies.rounds_reactions import blocked_by, to_darkness, to_nearness
from regraft.stacks.frog.utility import driving_utility

ROW: dict[str, Any] = {
    "leg": 1,
    "driving": True,
    "speed": 0.26,
    "speed_now": 0.26,
    "nearest": 1.0,
    "motion_power": 6.0,
    "max_velocity": 0.26,
    "pictures_asked": 1.0,
    "image_topic": "camera/image",
    "darkness": 0.0,
    "looks": 0.0,
    "squares": 0.0,
    "own_pictures": 0,
    "own_hits": 0,
    "corner_pictures": 0,
    "corner_hits": 0,
    "picture_energy": 0.0,
    "contacts": 0,
    "changes": 0,
}
NEAR, FAR = 0.45, 0.46


def rows(*changes: dict[str, Any]) -> Rows:
    """Return rows a second apart, each the one above with changes."""
    columns: dict[str, list[str]] = {"time": [], **{name: [] for name in ROW}}
    for time, change in enumerate(changes, start=1):
        columns["time"].append(str(time))
        for name, value in {**ROW, **change}.items():
            columns[name].append(written(value))
    return Rows(columns)


@pytest.mark.parametrize(
    ("nearest", "speed", "maximum", "satisfied", "if_at_most", "if_commanded"),
    [
        (FAR, 0.26, 0.26, True, True, True),
        (NEAR, 0.26, 0.26, False, False, False),
        (NEAR, 0.18, 0.26, False, True, False),
        (NEAR, 0.17, 0.26, True, True, False),
        (NEAR, 0.20, 0.17, False, False, True),
        (0.458, 0.26, 0.26, True, True, True),
    ],
)
def test_it_moves_safely_where_nothing_is_near_or_slowly(
    nearest: float, speed: float, maximum: float, satisfied: bool, if_at_most: bool, if_commanded: bool
) -> None:
    drive = measures.Drive(1.0, nearest, 0.2, speed, maximum, 6.0, 1)
    assert measures.moves_safely(drive) is satisfied
    assert measures.at_most_slowly(drive) is if_at_most
    assert measures.is_commanded_safely(drive) is if_commanded
    assert measures.moves_safely_on_average(drive) is (nearest >= 0.458)


def test_a_second_of_driving_is_worth_what_the_definition_says_of_distance_and_speed_at_its_end() -> None:
    seconds = [(FAR, 0.26, 0.1), (NEAR, 0.26, 0.1), (NEAR, 0.17, 0.25)]
    found = rows(*({"nearest": near, "speed_now": now, "speed": mean} for near, now, mean in seconds))
    worth = [driving_utility(near, now) for near, now, _ in seconds]
    assert worth[1] == 0.0
    assert measures.visiting_utility(found) == pytest.approx(sum(worth) / 3)
    by_mean = measures.other_visiting_utility(
        found, satisfied=measures.moves_safely_on_average, speed=measures.mean_speed
    )
    assert by_mean == pytest.approx(sum(driving_utility(near, mean) for near, _, mean in seconds) / 3)


def test_the_power_may_be_read_as_that_of_a_whole_leg() -> None:
    found = rows({"motion_power": 4.0, "speed_now": 0.13}, {"motion_power": 8.0}, {"leg": 2, "motion_power": 5.0})
    in_watts = measures.other_visiting_utility(found, cost=measures.mean_power)
    assert in_watts == pytest.approx((0.5 / 6.0 + 1.0 / 6.0 + 1.0 / 5.0) / 3)
    in_joules = measures.other_visiting_utility(found, cost=measures.energy)
    assert in_joules == pytest.approx((0.5 / 12 + 1 / 12 + 1 / 5) / 3)


def test_seconds_without_a_drive_do_not_count() -> None:
    with_waiting = rows({}, {"driving": False, "speed": 0.0}, {})
    assert measures.visiting_utility(with_waiting) == measures.visiting_utility(rows({}, {}))
    assert math.isnan(measures.visiting_utility(rows({"driving": False})))


def test_where_the_paper_says_or_the_script_says_and() -> None:
    for nearest, speed, maximum, text, script in (
        (FAR, 0.26, 0.26, True, False),
        (FAR, 0.10, 0.10, True, True),
        (NEAR, 0.10, 0.10, True, False),
        (NEAR, 0.26, 0.26, False, False),
    ):
        row = measures.PublishedRow(measures.share_of_range(nearest), speed / 0.26, 40.0, maximum)
        assert measures.text_satisfied(row) is text
        assert measures.script_satisfied(row) is script


def test_the_published_power_of_a_leg_is_a_sum_of_samples_known_when_it_is_over() -> None:
    found = measures.published_rows(rows(*[{}] * 6, *[{"leg": 2}] * 4))
    assert [row.leg_power for row in found] == pytest.approx([3 * motion_power(0.26)] * 4)


def test_hits_are_counted_per_picture_or_as_published_per_call() -> None:
    found = rows({"own_pictures": 2, "corner_pictures": 6, "corner_hits": 6, "own_hits": 1, "looks": 4.0})
    assert measures.hits_per_picture(found) == pytest.approx(7 / 8)
    assert measures.hits_per_look(found) == pytest.approx(7 / 4)


def test_the_budget_is_what_was_really_taken_on_board() -> None:
    within, beyond = 120 * PICTURE_ENERGY, 121 * PICTURE_ENERGY
    found = rows({"picture_energy": within}, {"picture_energy": beyond, "own_pictures": 1, "own_hits": 1})
    assert measures.within_budget_share(found) == 0.5
    assert measures.detecting_utility(found) == 0.5


def test_the_published_budget_costs_n_times_too_much_and_counts_rows_on_board_only() -> None:
    found = rows(
        {"squares": 119.0},
        {"squares": 120.0},
        {"squares": 999.0, "image_topic": "corner_camera/image", "corner_pictures": 3, "corner_hits": 3, "looks": 1.0},
    )
    assert measures.published_detecting_utility(found) == pytest.approx(3.0 * 0.5)


@given(st.lists(st.tuples(st.floats(0.12, 3.5), st.floats(0.0, 0.26), st.sampled_from([0.10, 0.18, 0.26])), min_size=1))
def test_the_utility_is_never_more_than_without_the_requirement(seconds: list[tuple[float, float, float]]) -> None:
    found = rows(*({"nearest": d, "speed_now": v, "max_velocity": m} for d, v, m in seconds))
    without = measures.other_visiting_utility(found, lambda drive: True)
    assert 0.0 <= measures.visiting_utility(found) <= without + 1e-12
    assert measures.visiting_utility(found) == pytest.approx(measures.other_visiting_utility(found))
    assert 0.0 <= measures.safe_share(found) <= 1.0
    assert measures.safe_share(found) >= 1.0 - measures.near_share(found) - 1e-12


def test_what_the_utilities_cost_is_counted() -> None:
    counted = {"own_pictures": 2, "corner_pictures": 4, "corner_hits": 3, "contacts": 1, "changes": 7, "leg": 2}
    found = rows({"motion_power": 4.0}, {"motion_power": 5.0, "driving": False}, {"motion_power": 6.0, **counted})
    figures = {name: measure(found) for name, measure in COLUMNS["corrected"].items()}
    expected = {"drive energy (J)": 10.0, "pictures": 6.0, "hits": 3.0, "contacts": 1.0, "adaptations applied": 7.0}
    assert {name: figures[name] for name in expected} == expected
    assert figures["legs"] == 2.0
    assert all(math.isfinite(value) for name, value in figures.items() if name != "U_det, per call")


def test_a_disturbance_is_answered_when_the_change_is_in_effect_and_not_when_it_was_over_before() -> None:
    near, slow = {"nearest": NEAR}, {"nearest": NEAR, "max_velocity": 0.10}
    assert to_nearness(rows({}, near, near, slow, {}, near, {})) == Reactions(2, (2.0,))
    dark = {"darkness": 0.8}
    assert to_darkness(rows({}, dark, {**dark, "pictures_asked": 3.0})) == Reactions(1, (1.0,))
    corner = {"image_topic": "corner_camera/image"}
    assert to_darkness(rows({}, {**dark, **corner})) == Reactions(1, (0.0,)), "answered within the second"
    assert to_darkness(rows(corner, {**dark, **corner})) == Reactions(0, ()), "no need"


@given(st.integers(0, 10_000))
def test_the_corner_camera_is_blocked_for_thirty_percent_of_the_time_differently_for_each_seed(seed: int) -> None:
    assert blocked(seed) == blocked(seed)
    assert blocked(seed) != blocked(seed + 1)
    is_blocked = blocked_by(blocked(seed))
    share = sum(is_blocked(n / 10) for n in range(int(10 * SECONDS))) / (10 * SECONDS)
    assert share == pytest.approx(SHARE, abs=0.005)
