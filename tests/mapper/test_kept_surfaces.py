"""Promises of localizing with surfaces that are kept, and of snapshots of a map that stays."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from regraft.bus_schema.messages import geometry
from regraft.planar import Pose2D
from regraft.services.mapper.mapping import GridSettings, Mapping
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.maps.scan import Scan
from regraft.services.mapper.matching.localizer import KEPT_BEYOND, MatchingLocalizer
from regraft.testing import Rig

from .room import MOUNT, RANGE, THINGS, WALLS, Box, cast, circle
from .test_map_localizer import Walk, room_map

LENGTH = 60.0
"""m of a corridor that is longer than the part of a map whose surfaces are found at once."""
POSTS: list[Box] = [(x, 0.3 + 0.2 * math.sin(x), x + 0.3, 0.7) for x in np.arange(0.5, LENGTH, 1.3).tolist()]
CORRIDOR: list[Box] = [(0.0, -1.1, LENGTH, -1.0), (0.0, 1.0, LENGTH, 1.1), *POSTS]


def corridor() -> Grid:
    grid = Grid(0.05, (0.0, 0.0), 1.0, 100.0)
    cells = np.zeros((60, round(LENGTH / 0.05)), np.int8)
    for low_x, low_y, high_x, high_y in CORRIDOR:
        columns = slice(round(low_x / 0.05), round(high_x / 0.05))
        cells[round((low_y + 1.5) / 0.05) : round((high_y + 1.5) / 0.05), columns] = 100
    grid.fill(cells, 0.0, -1.5)
    return grid


def test_a_robot_is_located_all_along_a_map_that_is_longer_than_what_is_kept() -> None:
    grid, keeping = corridor(), MatchingLocalizer(keeps_surfaces=True)
    assert LENGTH > 2.0 * (RANGE + KEPT_BEYOND)
    for number, x in enumerate(np.arange(2.0, LENGTH - 2.0, 0.5).tolist()):
        truth = Pose2D(x, -0.3, 0.1)
        ranges = cast(CORRIDOR, truth.compose(MOUNT), number).astype(np.float64)
        scan, guess = Scan(0.0, ranges, MOUNT), Pose2D(x + 0.06, -0.35, 0.14)
        kept, searched = keeping.locate(grid, scan, guess), MatchingLocalizer().locate(grid, scan, guess)
        assert kept.fits
        assert kept.pose.distance(truth) < 0.05
        assert kept.pose.distance(searched.pose) < 1e-3


@pytest.mark.parametrize("shift", [Pose2D(), Pose2D(0.9, 0.7, 2.0)])
def test_kept_surfaces_lead_to_the_same_place_also_for_a_robot_that_was_lost(shift: Pose2D) -> None:
    errors = []
    for kept in (False, True):
        with Rig() as rig:
            walk = Walk(rig, shift=shift, drift=0.01, parameters={"keep_surfaces": kept})
            rig.publish("map", room_map())
            walk.go(12.0)
            errors.append(walk.error)
    assert max(errors) < 0.05
    assert abs(errors[0] - errors[1]) < 1e-3


def test_a_robot_that_was_lost_is_found_near_by_although_the_map_has_many_places_alike() -> None:
    grid, localizer = corridor(), MatchingLocalizer()
    truth, guess = Pose2D(30.0, -0.3, 0.1), Pose2D(30.25, -0.05, 0.4)
    blinded = Scan(0.0, np.full(360, 0.5), MOUNT)
    while not localizer.lost:
        assert not localizer.locate(grid, blinded, guess).fits
    ranges = cast(CORRIDOR, truth.compose(MOUNT), 1).astype(np.float64)
    fix = localizer.locate(grid, Scan(0.0, ranges, MOUNT), guess)
    assert fix.fits
    assert fix.pose.distance(truth) < 0.05


def test_scans_do_not_fit_the_inside_of_a_thick_wall() -> None:
    grid = Grid(0.05, (0.0, 0.0), 1.0, 100.0)
    cells = np.full((400, 400), 100, np.int8)
    cells[180:220, 20:380] = 0
    grid.fill(cells, -10.0, -10.0)
    walls: list[Box] = [(-10.0, 1.0, 10.0, 10.0), (-10.0, -10.0, 10.0, -1.0)]
    scan = Scan(0.0, cast(walls, MOUNT, 1).astype(np.float64), MOUNT)
    there = MatchingLocalizer(keeps_surfaces=True).locate(grid, scan, Pose2D(0.02, -0.03, 0.02))
    in_the_wall = MatchingLocalizer(keeps_surfaces=True).locate(grid, scan, Pose2D(0.0, 3.0, 1.1))
    assert (there.fits, in_the_wall.fits) == (True, False)


def test_another_map_ends_what_was_kept_of_the_one_before() -> None:
    with Rig() as rig:
        walk = Walk(rig, parameters={"keep_surfaces": True})
        rig.publish("map", room_map())
        walk.go(4.0)
        moved = geometry.Pose.planar(-2.5, -2.1, 0.0)
        rig.publish("map", replace(room_map(4.0), origin=moved))
        walk.go(4.0)
        assert walk.place[-1].pose.x - circle(walk.ticks * 0.05).x == pytest.approx(0.1, abs=0.03)


def test_a_snapshot_has_the_scans_that_came_after_the_snapshot_before() -> None:
    mapping = Mapping(GridSettings(), MatchingLocalizer())
    states = []
    for number in range(3):
        stamp = float(number)
        mapping.take_odometry(stamp, circle(stamp))
        ranges = cast(WALLS + THINGS, circle(stamp).compose(MOUNT), number).astype(np.float64)
        mapping.take_scan(Scan(stamp, ranges, MOUNT))
        assert mapping.grid is not None
        states.append(mapping.snapshot()["grid"])
        assert states[-1] == mapping.grid.snapshot()
    assert states[0] != states[1] != states[2]
