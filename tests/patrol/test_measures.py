"""The figures of a patrol, of rows written by hand."""

from __future__ import annotations

import math

import pytest

from regraft.evaluation.reactions import Reactions
from regraft.evaluation.rows import Rows
from regraft.stacks.patrol.studies import patrol_measures as measures

DEFAULTS = {
    "safety": "1",
    "performance": "0.8",
    "energy": "0.5",
    "speed": "0.4",
    "places": "0",
    "error": "0.1",
    "charge": "0.9",
    "uses_laser": "1",
    "uses_camera": "0",
    "max_velocity": "0.4",
    "laser_fails": "0",
    "camera_fails": "0",
    "crowded": "0",
}


def rows(count: int = 5, **columns: list[object]) -> Rows:
    """Return rows of a second each; columns that are not given have a value that is well."""
    found = {"time": [str(second) for second in range(count)]}
    for name, usual in DEFAULTS.items():
        found[name] = [str(value) for value in columns[name]] if name in columns else [usual] * count
    return Rows(found)


def test_rest_and_a_second_without_a_mode_have_their_names() -> None:
    run = Rows({"realization": ["", "slow", "__DEFAULT__"]})
    assert measures.realizations(run) == ["no mode", "slow", "at rest"]


def test_a_lap_is_complete_at_its_seventh_place_or_never() -> None:
    assert measures.time_to_completion(rows(places=[0, 3, 6, 7, 8])) == 3.0
    assert math.isnan(measures.time_to_completion(rows(places=[0, 3, 6, 6, 6])))
    assert measures.places(rows(places=[0, 3, 6, 6, 6])) == 6.0


def test_requirements_are_met_where_all_three_are_and_unknown_seconds_count_for_none() -> None:
    run = rows(safety=[1, 0.2, 1, 1, ""], performance=[0.8, 0.8, 0.05, 0.8, 0.8], energy=[0.5, 0.5, 0.5, 0.9, 0.5])
    assert measures.requirements_met(run) == 0.25
    assert (measures.safe_share(run), measures.performing_share(run), measures.thrifty_share(run)) == (0.75, 0.8, 0.8)


def test_a_robot_that_is_charged_need_not_get_on() -> None:
    run = rows(performance=[0.8, 0, 0, 0, 0.8], charge=[0.4, 0.4, 0.5, 0.6, 0.6])
    assert measures.performing_share(run) == pytest.approx(2 / 3)
    assert measures.requirements_met(run) == pytest.approx(2 / 3)


def test_a_robot_stands_where_it_hardly_moves_and_is_not_charged() -> None:
    run = rows(speed=["", 0, 0.01, 0, 0.4], charge=[0.4, 0.4, 0.4, 0.5, 0.5])
    assert (measures.standing(run), measures.charging(run)) == (2.0, 1.0)


def test_a_design_works_while_a_sensor_that_it_uses_does() -> None:
    run = rows(
        uses_laser=[1, 1, 0, 0, 0], uses_camera=[0, 0, 1, 1, 0], laser_fails=[0, 1, 1, 1, 1], camera_fails=[0] * 5
    )
    assert measures.without_design(run) == 2.0


def test_the_way_is_the_sum_of_the_speeds_and_is_taken_apart_by_what_lasts() -> None:
    run = rows(speed=["", 0.5, 0.4, 0.1, 0.5], laser_fails=[1, 0, 0, 1, 1], crowded=[0] * 5)
    assert measures.driven(run) == pytest.approx(1.5)
    assert measures.driven_during(measures.LASER)(run) == pytest.approx(0.6)
    assert measures.driven_during(measures.CROWD)(run) == 0.0
    assert measures.driven_when_low(rows(charge=[0.6, 0.49, 0.5, 0.3, ""])) == pytest.approx(0.8)


def test_the_worst_error_is_that_of_a_second_in_which_a_place_was_reached() -> None:
    assert measures.worst_error(rows(places=[0, 1, 1, 2, 2], error=[0.9, 0.1, 0.9, 0.2, 0.9])) == pytest.approx(0.2)
    assert math.isnan(measures.worst_error(rows()))


def test_reactions_are_from_a_disturbance_until_its_answer() -> None:
    blind = rows(laser_fails=[0, 1, 1, 1, 0], uses_laser=[1, 1, 1, 0, 0])
    assert measures.to_laser(blind) == Reactions(1, (2.0,))
    low = rows(charge=[0.6, 0.4, 0.4, 0.4, 0.4], max_velocity=[0.4, 0.4, 0.1, 0.1, 0.4])
    assert measures.to_low_battery(low) == Reactions(1, (1.0,))
    crowd = rows(crowded=[0, 1, 1, 1, 1], safety=[0.1, 0.9, 0.1, 0.9, 0.1], max_velocity=[0.4, 0.4, 0.4, 0.4, 0.1])
    assert measures.to_crowd(crowd) == Reactions(1, (2.0,))
    assert math.isnan(measures.mean_reaction(measures.to_laser)(rows()))
