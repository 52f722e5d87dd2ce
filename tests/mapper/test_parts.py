"""Promises of the mapper's parts that hold for all inputs."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from regraft.planar import Pose2D, wrap_angle
from regraft.services.mapper.maps import map_files
from regraft.services.mapper.maps.grid import ENOUGH, Grid
from regraft.services.mapper.maps.map_files import FiledMap
from regraft.services.mapper.maps.rays import insert
from regraft.services.mapper.maps.scan import Scan
from regraft.services.mapper.matching.matcher import match
from regraft.services.mapper.matching.surface import Surface
from regraft.services.mapper.odometry_log import OdometryLog

from .room import MOUNT, THINGS, WALLS, cast

numbers = st.floats(-10.0, 10.0)
poses = st.builds(Pose2D, numbers, numbers, st.floats(-3.1, 3.1))


def close(one: Pose2D, other: Pose2D) -> bool:
    return one.distance(other) < 1e-9 and abs(wrap_angle(one.yaw - other.yaw)) < 1e-9


def scan_at(pose: Pose2D, seed: int = 0) -> Scan:
    return Scan(0.0, cast(WALLS + THINGS, pose.compose(MOUNT), seed).astype(np.float64), MOUNT)


@given(poses, poses)
@settings(deadline=None)
def test_the_motion_from_one_pose_to_another_leads_there(one: Pose2D, other: Pose2D) -> None:
    assert close(one.compose(one.to(other)), other)
    assert close(one.compose(one.inverse()), Pose2D())


@given(st.lists(st.tuples(st.floats(0.02, 0.2), st.floats(-0.01, 0.01)), min_size=2, max_size=30), st.floats(0.0, 1.0))
@settings(deadline=None)
def test_a_pose_between_two_odometries_lies_between_them(steps: list[tuple[float, float]], share: float) -> None:
    log, stamp, x = OdometryLog(), 0.0, 0.0
    for elapsed, moved in steps:
        before, stamp, x = (stamp, x), stamp + elapsed, x + moved
        assert log.add(stamp, Pose2D(x, 0.0, 0.0)) is None
    between = log.at(before[0] + share * (stamp - before[0]))
    if between is not None:
        assert min(before[1], x) - 1e-9 <= between.x <= max(before[1], x) + 1e-9
    assert log.at(stamp + 0.01) is None
    assert log.at(stamp) == Pose2D(x, 0.0, 0.0)


@given(st.floats(0.05, 1.0), st.floats(1.2, 50.0), st.floats(-3.0, 3.0))
@settings(deadline=None)
def test_no_robot_moves_faster_than_it_can(elapsed: float, distance: float, way: float) -> None:
    log = OdometryLog()
    log.add(1.0, Pose2D())
    jump = log.add(1.0 + elapsed, Pose2D(distance * math.cos(way), distance * math.sin(way), 0.0))
    assert jump is not None
    assert jump.before == Pose2D()
    assert log.at(1.0) is None


@given(st.lists(st.tuples(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0)), max_size=8))
@settings(max_examples=40, deadline=None)
def test_a_growing_grid_keeps_its_cells_where_they_were_and_never_becomes_too_large(
    corners: list[tuple[float, float]],
) -> None:
    grid = Grid(0.1, (0.3, -0.2), 4.0, 20.0)
    row, column = round((1.0 - grid.y) / 0.1), round((0.5 - grid.x) / 0.1)
    grid.cells[row, column] = 40
    for x, y in corners:
        fits = grid.cover((x, y), (x + 0.5, y + 0.5))
        inside = grid.x <= x + 1e-9 and x + 0.5 <= grid.x + 0.1 * grid.cells.shape[1] + 1e-9
        assert inside or not fits
        assert max(grid.cells.shape) <= 200
        assert grid.echoes.shape == (*grid.cells.shape, 3)
    marked = np.argwhere(grid.cells == 40)
    assert len(marked) == 1
    assert grid.y + marked[0][0] * 0.1 == pytest.approx(1.0)
    assert grid.x + marked[0][1] * 0.1 == pytest.approx(0.5)


@given(poses, st.integers(0, 5))
@settings(max_examples=30, deadline=None)
def test_a_restored_grid_is_the_same_to_the_last_cell(start: Pose2D, scans: int) -> None:
    grid = Grid(0.05, (0.0, 0.0), 4.0, 30.0)
    for number in range(scans):
        insert(grid, Pose2D(0.1 * number, 0.05, start.yaw), scan_at(Pose2D(0.1 * number, 0.05, start.yaw), number))
    other = Grid(0.05, (9.0, 9.0), 1.0, 30.0)
    other.restore(grid.snapshot())
    assert np.array_equal(other.cells, grid.cells)
    assert np.array_equal(other.echoes, grid.echoes)
    assert (other.x, other.y) == (grid.x, grid.y)
    with pytest.raises(ValueError, match=r"must be 0\.1 m"):
        Grid(0.1, (0.0, 0.0), 1.0, 30.0).restore(grid.snapshot())


def test_the_place_of_a_wall_is_settled_by_its_first_echoes() -> None:
    grid = Grid(0.05, (0.0, 0.0), 8.0, 8.0)
    for number in range(40):
        insert(grid, Pose2D(), scan_at(Pose2D(), number))
    first = grid.window(0.0, 0.0, 4.0).surface()
    assert int(grid.echoes[..., 2].max()) < 2 * ENOUGH
    for number in range(20):
        insert(grid, Pose2D(0.01, 0.0, 0.0), scan_at(Pose2D(), number))
    again = grid.window(0.0, 0.0, 4.0).surface()
    # The cells whose first echoes are long past have not moved, though every echo lies a centimetre further.
    kept = [np.abs(first - point).sum(axis=1).min() < 1e-12 for point in again]
    assert np.mean(kept) > 0.7


@given(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12), st.floats(-0.15, 0.15), st.integers(1, 1000))
@settings(max_examples=40, deadline=None)
def test_a_scan_is_matched_from_a_guess_that_is_off(x: float, y: float, yaw: float, seed: int) -> None:
    grid = Grid(0.05, (0.0, 0.0), 8.0, 8.0)
    for number in range(6):
        insert(grid, Pose2D(0.2, -0.3, 0.4), scan_at(Pose2D(0.2, -0.3, 0.4), number))
    surface = Surface.of(grid.window(0.2, -0.3, 4.0))
    truth = Pose2D(0.25, -0.28, 0.5)
    found = match(surface, scan_at(truth, seed).points(), truth.compose(Pose2D(x, y, yaw)))
    assert found.pose.distance(truth) < 0.02
    assert abs(wrap_angle(found.pose.yaw - truth.yaw)) < 0.015
    assert found.ratio > 0.9


@given(
    arrays(np.int8, array_shapes(min_dims=2, max_dims=2, max_side=20), elements=st.sampled_from([-1, 0, 30, 70, 100])),
    st.sampled_from([0.02, 0.05, 0.25]),
    numbers,
    numbers,
)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_map_file_keeps_what_is_occupied_free_and_unknown(
    tmp_path: Path, cells: np.ndarray, resolution: float, x: float, y: float
) -> None:
    path = tmp_path / "map.yaml"
    map_files.save(path, FiledMap(cells, resolution, x, y))
    read = map_files.load(path)
    assert (read.resolution, read.x, read.y) == (resolution, x, y)
    assert np.array_equal(read.cells >= 65, cells >= 65)
    assert np.array_equal((read.cells >= 0) & (read.cells < 25), (cells >= 0) & (cells < 50))
    assert np.array_equal(read.cells < 0, cells < 0)


@pytest.mark.parametrize(
    ("mode", "expected"), [("trinary", [0, -1, 100]), ("scale", [0, 67, 100]), ("raw", [-1, 100, 0])]
)
def test_each_mode_of_map_server_is_read(tmp_path: Path, mode: str, expected: list[int]) -> None:
    cv2.imwrite(str(tmp_path / "m.png"), np.array([[254, 100 if mode != "trinary" else 120, 0]], np.uint8))
    text = f"image: m.png\nmode: {mode}\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.8\nfree_thresh: 0.2\n"
    (tmp_path / "m.yaml").write_text(text)
    found = map_files.load(tmp_path / "m.yaml").cells[0].tolist()
    assert found[0] == expected[0]
    assert found[2] == expected[2]
    assert found[1] == pytest.approx(expected[1], abs=2)
