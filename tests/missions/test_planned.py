"""FROG's rounds with the forecast: fast where nothing is near, and through the camera that is expected to see."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.model.adaptation import SetParameters
from regraft.testing import Rig
from tests.missions.acting import CORNER, OWN
from tests.missions.test_rounds import FAR, NEAR, Rounds


@contextmanager
def planned(mission: str = "rounds_planned") -> Iterator[tuple[Rig, Rounds]]:
    """Start the rounds with a planner; all entries are known that it is told of."""
    with Rig() as rig:
        rig.add(ForecastPlanner, "forecast")
        rounds = Rounds(rig, mission, drives=60.0, cameras=True)
        rounds.senses.values["corner_faults"] = 0.0
        yield rig, rounds


@pytest.mark.parametrize(("mission", "careful"), [("rounds_planned", 0.17), ("rounds_planned_018", 0.10)])
def test_it_slows_down_as_soon_as_something_is_near_and_only_as_long(mission: str, careful: float) -> None:
    with planned(mission) as (rig, rounds):
        rounds.senses.values["nearest"] = FAR
        rig.advance(3.0)
        assert rounds.speeds == []
        rounds.senses.values["nearest"] = NEAR
        rig.advance(1.0)
        assert [speed for _, speed in rounds.speeds] == [careful]
        rounds.senses.values["nearest"] = FAR
        rig.advance(1.0)
        assert [speed for _, speed in rounds.speeds] == [careful, 0.26]


def test_without_the_data_the_speed_is_left_alone() -> None:
    with planned() as (rig, rounds):
        rig.runtimes.pop("system_reflection").leave()
        rig.advance(10.0)
        assert rounds.speeds == []


def test_it_looks_through_the_corner_camera_unless_that_is_blocked() -> None:
    with planned() as (rig, rounds):
        rig.advance(4.0)
        assert rounds.cameras == [CORNER]
        rounds.senses.values["corner_faults"] = 1.0
        rig.advance(8.0)
        assert rounds.cameras == [CORNER, OWN]


def test_more_pictures_are_taken_of_what_is_seen_well() -> None:
    with planned() as (rig, rounds):
        rig.advance(2.0)
        asked = [change.parameters for change in rounds.manager.changes if isinstance(change, SetParameters)]
        assert {"pictures": 3} in asked
