"""Promises of the mapper that matches scans."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from regraft.planar import Pose2D
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.testing import Rig

from .room import THINGS, WALLS, Ride, circle


@pytest.fixture
def ride() -> Iterator[Ride]:
    """Return a robot with a mapper, about to start."""
    with Rig() as rig:
        yield Ride(rig, Mapper)


def drifting(pose: Pose2D, seconds: float) -> Pose2D:
    """Return what an odometry says that turns away by half a degree a second, and creeps aside."""
    return Pose2D(0.004 * seconds, 0.0, 0.009 * seconds).compose(pose)


def test_a_drifting_odometry_is_corrected_and_its_drift_told_with_its_size(ride: Ride) -> None:
    ride.odometry = drifting
    ride.go(16.0)
    assert ride.error < 0.05
    drift = next(told for told in ride.told if told.subject == "drift")
    assert drift.level.value == "warning"
    last = ride.mapper.mapping.drift.drift
    assert last.turn == pytest.approx(-0.009 * 16.0, abs=0.04)
    ride.odometry = lambda pose, now: drifting(pose, 16.0)
    ride.go(28.0)
    assert ride.levels("drift")[-1] == "ok"
    with Rig() as rig:
        alone = Ride(rig, OdometryMapper, odometry=drifting)
        alone.go(16.0)
        assert alone.error > 0.1


def test_a_frozen_odometry_is_corrected(ride: Ride) -> None:
    ride.go(4.0)
    stands = circle(4.0)
    ride.odometry = lambda pose, now: stands
    ride.go(4.0)
    assert ride.error < 0.1


def test_a_robot_that_is_lifted_away_is_told_and_found_again(ride: Ride) -> None:
    ride.go(14.0)
    ride.way = lambda seconds: Pose2D(-1.9, -1.3, 2.5 + 0.1 * seconds)
    # The wheels do not notice: the odometry goes on turning from where it was.
    lifted_at = circle(14.0).compose(ride.way(14.0).inverse())
    ride.odometry = lambda pose, now: lifted_at.compose(pose)
    before = ride.mapper.mapping.grid
    assert before is not None
    cells = before.cells.copy()
    ride.go(5.0)
    assert ride.levels("localization") == ["error", "ok"]
    assert [event.kind for event in ride.rig.events if event.kind.startswith("mapper.")] == [
        "mapper.lost",
        "mapper.found",
    ]
    assert ride.error < 0.05
    after = ride.mapper.mapping.grid
    assert after is not None
    assert np.mean((after.cells > 0) != (cells > 0)) < 0.01


def test_surroundings_that_are_not_in_the_map_are_told_and_not_written_into_it(ride: Ride) -> None:
    ride.go(12.0)
    grid = ride.mapper.mapping.grid
    assert grid is not None
    ride.boxes = [(-1.45, -1.1, -1.35, 1.1), (0.9, -1.1, 1.0, 1.1), (-1.4, -1.15, 0.9, -1.05), (-1.4, 1.05, 0.9, 1.15)]
    ride.go(1.0)
    cells = grid.cells.copy()
    ride.go(2.5)
    assert ride.levels("localization")[0] == "error"
    assert np.array_equal(cells, grid.cells)
    assert ride.error < 0.05
    ride.boxes = WALLS + THINGS
    ride.go(2.0)
    assert ride.levels("localization")[-1] == "ok"


def test_people_around_the_robot_do_not_mislead_it(ride: Ride) -> None:
    ride.odometry = drifting
    ride.go(10.0)
    for second in range(6):
        angle = 0.6 * second
        x, y = 1.4 * math.cos(angle) - 0.3, 1.4 * math.sin(angle)
        ride.boxes = [*WALLS, *THINGS, (x, y, x + 0.3, y + 0.3), (-x, -y, 0.3 - x, 0.3 - y)]
        ride.go(1.0)
        assert ride.error < 0.05
    assert not ride.levels("localization")


def test_it_says_how_much_it_corrects_and_how_well_the_scans_fit(ride: Ride) -> None:
    ride.odometry = drifting
    ride.go(8.0)
    measured = ride.mapper.evaluate()
    assert measured["inlier_ratio"] > 0.9
    assert 0.0 < measured["correction"] < 0.02


def test_it_expects_to_be_better_and_to_cost_more_than_the_odometry_alone() -> None:
    context = {"travel_noise": 0.01, "distance": 50.0}
    here, alone = Mapper.estimate({}, context), OdometryMapper.estimate({}, context)
    assert here["pose_error"] < 0.1 < alone["pose_error"]
    assert here["map_quality"] > 0.9 > alone["map_quality"]
    assert here["cpu"] > alone["cpu"]
    assert Mapper.estimate({"resolution": 0.2}, context)["map_quality"] < here["map_quality"]
