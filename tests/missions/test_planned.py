"""FROG's rounds with the forecast: fast where nothing is near, and through the camera that is expected to see."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.testing import Rig
from tests.missions.acting import CORNER, OWN
from tests.missions.test_rounds import FAR, NEAR, Rounds

pytestmark = pytest.mark.slow


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


@pytest.mark.parametrize("sees", [True, False])
def test_whether_the_corner_camera_sees_the_hydrant_is_learned_from_its_pictures(sees: bool) -> None:
    with Rig() as rig:
        rig.add(ForecastPlanner, "forecast")
        rounds = Rounds(rig, "rounds_planned", drives=1.0)
        rounds.senses.values["corner_faults"] = 0.0
        rounds.navigator.reached.append(0.0)
        rounds.detector.seen_from = {0.0, 1.0} if sees else set()
        rig.advance(40.0)
        assert rounds.cameras[0] == CORNER
        assert rounds.detector.asked[0] == 1
        assert (OWN in rounds.cameras) is not sees
        if sees:
            assert rounds.detector.asked[-1] == 3
