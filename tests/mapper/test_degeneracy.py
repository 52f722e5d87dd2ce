"""Promises of what tells constrained directions from others."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.planar import FloatArray, Pose2D, wrap_angle
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.matching.degeneracy import CONSTRAINED, constrained_directions
from regraft.services.mapper.matching.matcher import match
from regraft.services.mapper.matching.surface import Surface

LEVER = 1.5
angles = st.floats(-math.pi, math.pi)


def information(normals: FloatArray, echoes: FloatArray) -> FloatArray:
    """Return the information matrix of echoes (n, 2; m) on surfaces with normals (n; rad)."""
    across = np.column_stack([np.cos(normals), np.sin(normals)])
    turning = across[:, 1] * echoes[:, 0] - across[:, 0] * echoes[:, 1]
    jacobian = np.column_stack([across, turning])
    matrix: FloatArray = jacobian.T @ jacobian
    return matrix


def corridor(heading: float, ends: int, count: int = 100) -> FloatArray:
    """Return the information of echoes on both walls of a corridor of 2 m, and of some on the wall at its end."""
    ahead = np.linspace(-3.0, 3.0, count - ends)
    walls = np.column_stack([ahead, np.where(np.arange(count - ends) % 2, 1.0, -1.0)])
    end = np.column_stack([np.full(ends, 3.0), np.linspace(-1.0, 1.0, ends)])
    echoes = Pose2D(yaw=heading).outward(np.vstack([walls, end]))
    normals = heading + np.concatenate([np.full(count - ends, math.pi / 2.0), np.zeros(ends)])
    return information(normals, echoes)


@given(angles, st.integers(0, 8))
@settings(deadline=None)
def test_along_a_corridor_nothing_is_constrained_but_across_it_and_its_heading_are(heading: float, ends: int) -> None:
    kept = constrained_directions(corridor(heading, ends), LEVER, 100.0)
    along, across = np.array([math.cos(heading), math.sin(heading)]), np.array([-math.sin(heading), math.cos(heading)])
    if ends == 0:
        assert kept @ [*along, 0.0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
        assert kept @ [*across, 0.0] == pytest.approx([*across, 0.0], abs=1e-6)
        assert kept @ [0.0, 0.0, 1.0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    assert np.linalg.matrix_rank(kept, tol=1e-6) == 2


@given(angles, st.integers(20, 40))
@settings(deadline=None)
def test_the_end_of_a_corridor_constrains_all(heading: float, ends: int) -> None:
    kept = constrained_directions(corridor(heading, ends), LEVER, 100.0)
    assert kept == pytest.approx(np.eye(3), abs=1e-9)


@given(st.lists(st.tuples(angles, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), min_size=1, max_size=60))
@settings(deadline=None)
def test_constrained_changes_are_kept_and_the_others_have_little_information(
    seen: list[tuple[float, float, float]],
) -> None:
    normals, x, y = np.array(seen).T
    matrix = information(normals, np.column_stack([x, y]))
    kept = constrained_directions(matrix, LEVER, float(len(seen)))
    assert kept @ kept == pytest.approx(kept, abs=1e-9)
    left_out = (np.eye(3) - kept) / np.array([1.0, 1.0, LEVER])
    most = np.linalg.eigvalsh(left_out.T @ matrix @ left_out)[-1]
    scale = np.linalg.norm(np.array([1.0, 1.0, LEVER])[:, None] * left_out, 2) ** 2
    assert most <= CONSTRAINED * len(seen) * scale * (1.0 + 1e-9) + 1e-9


def test_echoes_that_lie_nowhere_constrain_nothing_that_could_be_wrong() -> None:
    kept = constrained_directions(np.zeros((3, 3)), 1.0, 0.0)
    assert np.isfinite(kept).all()


def test_in_a_round_room_the_heading_is_the_odometry_s() -> None:
    turns = np.arange(0.0, math.tau, math.tau / 360)
    wall = 2.0 * np.column_stack([np.cos(turns), np.sin(turns)])
    grid = Grid(0.05, (0.0, 0.0), 8.0, 8.0)
    cells = np.zeros((100, 100), np.int8)
    columns, rows = np.floor((wall + 2.5) / 0.05).astype(int).T
    cells[rows, columns] = 100
    grid.fill(cells, -2.5, -2.5)
    found = match(Surface.of(grid.window(0.0, 0.0, 4.0)), wall, Pose2D(0.05, -0.04, 0.1))
    assert wrap_angle(found.pose.yaw - 0.1) == pytest.approx(0.0, abs=1e-3)
    assert math.hypot(found.pose.x, found.pose.y) < 0.01


@pytest.mark.parametrize("thickness", [1, 2, 3])
def test_a_wall_says_nothing_along_itself_however_thick_it_is(thickness: int) -> None:
    grid = Grid(0.05, (0.0, 0.0), 8.0, 8.0)
    cells = np.zeros((60, 120), np.int8)
    cells[40 : 40 + thickness] = 100
    grid.fill(cells, -3.0, -1.0)
    surface = Surface.of(grid.window(0.0, 0.0, 2.0))
    assert surface.weights[:, 0] == pytest.approx(0.02, abs=0.01)
    assert surface.weights[:, 1] == pytest.approx(0.0, abs=1e-6)
    assert surface.weights[:, 2] == pytest.approx(1.0, abs=1e-6)
