"""How good a map is: its overlap with the true one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label

Cells = NDArray[np.int8]
Mask = NDArray[np.bool_]

OCCUPIED_FROM = 65
FREE_UP_TO = 25
"""Per cent: Nav2's thresholds. Values between are neither."""
NEIGHBOURS = np.ones((3, 3), bool)


@dataclass(frozen=True, slots=True)
class MapQuality:
    """Intersections over unions (0 to 1) of what a map calls occupied and free with what is.

    ``occupied_iou`` forgives one cell. Right is each true surface cell with an occupied one of the map at most a cell
    away. Missing is each without. Too much is each occupied cell of the map with no true one at most a cell away.
    ``free_iou`` is over the free ground that the robot can see or get to. Cells next to obstacles are left out: there a
    cell more or less is forgiven.

    ``strict_occupied_iou`` and ``strict_free_iou`` forgive nothing. Occupied cells of the map within solid things
    count neither way.
    """

    occupied_iou: float
    free_iou: float
    strict_occupied_iou: float
    strict_free_iou: float

    @property
    def iou(self) -> float:
        """The lesser of both: a map must show the obstacles, and the way between them."""
        return min(self.occupied_iou, self.free_iou)


def map_quality(
    cells: Cells,
    resolution: float,
    origin: tuple[float, float],
    truth: Cells,
    truth_resolution: float,
    truth_origin: tuple[float, float],
    *,
    start: tuple[float, float],
) -> MapQuality:
    """Compare a map with the true one.

    Args:
        cells: the map's occupancy in per cent, -1 unknown; rows along y, columns along x.
        resolution: side (m) of its cells.
        origin: outer corner (x, y; m) of its cell (0, 0).
        truth: the true occupancy, likewise, nothing unknown; its cells are those that are counted.
        truth_resolution: side (m) of the true map's cells.
        truth_origin: outer corner (m) of the true map's cell (0, 0).
        start: a place (x, y; m) where the robot was; only the ground that is connected with it counts.

    Raises:
        ValueError: ``start`` does not lie on free ground of the true map.
    """
    is_occupied = truth >= OCCUPIED_FROM
    room = _room(~is_occupied, start, truth_resolution, truth_origin)
    surface = is_occupied & binary_dilation(room, NEIGHBOURS)
    shape, margin = truth.shape, _margin(cells.shape, resolution, origin, truth.shape, truth_resolution, truth_origin)
    is_occupied, room, surface = (np.pad(mask, margin) for mask in (is_occupied, room, surface))
    corner = (truth_origin[0] - margin * truth_resolution, truth_origin[1] - margin * truth_resolution)
    seen = _resampled(
        cells, resolution, origin, (shape[0] + 2 * margin, shape[1] + 2 * margin), truth_resolution, corner
    )
    mapped = seen >= OCCUPIED_FROM
    free = (seen >= 0) & (seen <= FREE_UP_TO)
    return MapQuality(
        _occupied_iou(mapped, is_occupied, surface),
        _free_iou(free, room, is_occupied),
        _iou(mapped & ~(is_occupied & ~surface), surface),
        _iou(free, room),
    )


def _occupied_iou(mapped: Mask, is_occupied: Mask, surface: Mask) -> float:
    right = int((surface & binary_dilation(mapped, NEIGHBOURS)).sum())
    missing = int(surface.sum()) - right
    too_much = int((mapped & ~binary_dilation(is_occupied, NEIGHBOURS)).sum())
    return _ratio(right, right + missing + too_much)


def _free_iou(free: Mask, room: Mask, is_occupied: Mask) -> float:
    certain = ~binary_dilation(is_occupied, NEIGHBOURS) | (is_occupied & ~binary_dilation(room, NEIGHBOURS))
    return _iou(free & certain, room & certain)


def _iou(mapped: Mask, true: Mask) -> float:
    return _ratio(int((mapped & true).sum()), int((mapped | true).sum()))


def _ratio(part: int, whole: int) -> float:
    return part / whole if whole else 1.0


def _room(is_free: Mask, start: tuple[float, float], resolution: float, origin: tuple[float, float]) -> Mask:
    """Return the free cells that are connected with a place."""
    areas, _ = label(is_free)
    column = int(np.floor((start[0] - origin[0]) / resolution))
    row = int(np.floor((start[1] - origin[1]) / resolution))
    rows, columns = is_free.shape
    if not (0 <= row < rows and 0 <= column < columns) or not is_free[row, column]:
        raise ValueError(f"the place ({start[0]:.2f}, {start[1]:.2f}) must lie on free ground of the true map")
    return np.asarray(areas == areas[row, column], bool)


def _margin(
    shape: tuple[int, ...],
    resolution: float,
    origin: tuple[float, float],
    truth_shape: tuple[int, ...],
    truth_resolution: float,
    truth_origin: tuple[float, float],
) -> int:
    """Return how many cells the map reaches beyond the true one at the most: what it shows there is too much."""
    beyond = [1.0]
    for axis, count, true_count in ((0, shape[1], truth_shape[1]), (1, shape[0], truth_shape[0])):
        end, true_end = origin[axis] + count * resolution, truth_origin[axis] + true_count * truth_resolution
        beyond += [truth_origin[axis] - origin[axis], end - true_end]
    return int(np.ceil(max(beyond) / truth_resolution))


def _resampled(
    cells: Cells,
    resolution: float,
    origin: tuple[float, float],
    shape: tuple[int, int],
    wanted_resolution: float,
    wanted_origin: tuple[float, float],
) -> Cells:
    """Return the map at the centres of another grid's cells, unknown where it does not reach."""
    rows = (wanted_origin[1] + (np.arange(shape[0]) + 0.5) * wanted_resolution - origin[1]) / resolution
    columns = (wanted_origin[0] + (np.arange(shape[1]) + 0.5) * wanted_resolution - origin[0]) / resolution
    row, column = np.floor(rows).astype(np.intp), np.floor(columns).astype(np.intp)
    inside = ((row >= 0) & (row < cells.shape[0]))[:, None] & ((column >= 0) & (column < cells.shape[1]))[None, :]
    values = cells[np.clip(row, 0, cells.shape[0] - 1)[:, None], np.clip(column, 0, cells.shape[1] - 1)[None, :]]
    return np.where(inside, values, np.int8(-1))
