"""Promises of the measure of a map's quality."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.evaluation.map_quality import MapQuality, map_quality

from .room import THINGS, WALLS, true_cells

TRUTH, RESOLUTION, ORIGIN = true_cells(WALLS + THINGS)
START = (0.5, 0.0)


def quality(cells: np.ndarray, origin: tuple[float, float] = ORIGIN) -> MapQuality:
    return map_quality(cells, RESOLUTION, origin, TRUTH, RESOLUTION, ORIGIN, start=START)


def test_the_true_map_is_perfect() -> None:
    assert quality(TRUTH) == MapQuality(1.0, 1.0, 1.0, 1.0)


def test_what_lies_behind_surfaces_need_not_be_known() -> None:
    hollow = TRUTH.copy()
    hollow[:1, :], hollow[:, :1] = -1, -1
    assert quality(hollow).iou == 1.0


def test_an_unknown_map_is_worth_nothing() -> None:
    assert quality(np.full_like(TRUTH, -1)) == MapQuality(0.0, 0.0, 0.0, 0.0)


def test_a_map_of_free_ground_alone_is_worth_nothing() -> None:
    assert quality(np.zeros_like(TRUTH)).iou == 0.0


@given(st.integers(-1, 1), st.integers(-1, 1))
@settings(deadline=None)
def test_a_cell_is_forgiven(along: int, across: int) -> None:
    shifted = (ORIGIN[0] + along * RESOLUTION, ORIGIN[1] + across * RESOLUTION)
    assert quality(TRUTH, shifted).occupied_iou == 1.0
    assert quality(TRUTH, shifted).free_iou > 0.97


def test_strictly_no_cell_is_forgiven() -> None:
    shifted = quality(TRUTH, (ORIGIN[0] + RESOLUTION, ORIGIN[1]))
    assert shifted.occupied_iou == 1.0
    assert shifted.strict_occupied_iou < 0.9
    assert shifted.strict_free_iou < shifted.free_iou


def test_three_cells_are_not_forgiven() -> None:
    assert quality(TRUTH, (ORIGIN[0] + 3 * RESOLUTION, ORIGIN[1])).iou < 0.6


def test_half_of_the_room_is_half_of_the_map() -> None:
    half = TRUTH.copy()
    half[:, half.shape[1] // 2 :] = -1
    found = quality(half)
    assert found.occupied_iou == pytest.approx(0.5, abs=0.1)
    assert found.free_iou == pytest.approx(0.5, abs=0.1)


def test_free_ground_beyond_the_walls_is_too_much() -> None:
    wider = np.pad(TRUTH, 30)
    found = quality(wider, (ORIGIN[0] - 30 * RESOLUTION, ORIGIN[1] - 30 * RESOLUTION))
    assert found.occupied_iou == 1.0
    assert found.free_iou < 0.6


@given(st.integers(0, 80), st.integers(0, 90))
@settings(max_examples=30, deadline=None)
def test_an_obstacle_that_is_not_there_makes_it_worse(row: int, column: int) -> None:
    wrong = TRUTH.copy()
    wrong[row : row + 4, column : column + 4] = 100
    assert quality(wrong).iou <= 1.0
    if not TRUTH[max(0, row - 1) : row + 5, max(0, column - 1) : column + 5].any():
        assert quality(wrong).occupied_iou < 1.0


@pytest.mark.parametrize("start", [(0.0, 1.5), (9.0, 0.0)])
def test_a_start_within_an_obstacle_or_off_the_map_is_refused(start: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="must lie on free ground"):
        map_quality(TRUTH, RESOLUTION, ORIGIN, TRUTH, RESOLUTION, ORIGIN, start=start)
