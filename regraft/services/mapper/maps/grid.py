"""The occupancy grid: how sure the mapper is of every square of the ground.

H. Moravec, A. Elfes: High resolution maps from wide angle sonar. ICRA 1985; in logarithms of odds.
"""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from regraft.bus_schema.annotations import PlainValue

Cells = NDArray[np.int8]
Echoes = NDArray[np.uint16]
FloatArray = NDArray[np.float64]

UNIT = 0.05
"""Natural logarithm of the odds that one step of a cell represents: whole numbers make states repeatable."""
SUREST = 70
"""Steps to either side that a cell goes at the most (97 %): what has moved away must fade within seconds."""
UNKNOWN = 0
"""A cell that nothing was ever learnt of; cells that are known to either side never have this value."""
OCCUPIED = 13
"""Steps from which a cell counts as occupied: 65 %, as in Nav2's map server."""
FINE = 256
"""Parts of a cell's side in which the places of echoes within it are counted."""
ENOUGH = 12
"""Echoes whose mean is the place of a cell's surface. No more are taken in: walls must not creep with the robot."""


def _per_cent() -> Cells:
    steps = np.arange(-128, 128)
    table: Cells = np.round(100.0 / (1.0 + np.exp(-steps * UNIT))).astype(np.int8)
    table[128 + UNKNOWN] = -1
    return table


_PER_CENT = _per_cent()


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """A rectangle of a grid. ``cells`` and ``echoes`` are views: writing to them changes the grid.

    (``x``, ``y``) in m is the outer corner of the rectangle's cell (0, 0).
    """

    cells: Cells
    echoes: Echoes
    x: float
    y: float
    resolution: float

    def copy(self) -> Window:
        """Return a copy, for work next to the grid that changes on."""
        return replace(self, cells=self.cells.copy(), echoes=self.echoes.copy())

    def surface_cells(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns of the occupied cells in which a surface lies, in the order of `surface`."""
        rows, columns = np.nonzero(self.cells >= OCCUPIED)
        echoed = self.echoes[rows, columns, 2] > 0
        return rows[echoed], columns[echoed]

    def surface(self, cells: tuple[NDArray[np.intp], NDArray[np.intp]] | None = None) -> FloatArray:
        """Return where (n, 2; m) the surfaces lie in the occupied cells: the means of their echoes.

        ``cells`` are the `surface_cells`, if they are known.
        """
        rows, columns = self.surface_cells() if cells is None else cells
        sums = self.echoes[rows, columns].astype(np.float64)
        within = (sums[:, :2] / sums[:, 2:] + 0.5) / FINE
        return np.column_stack([columns, rows]) * self.resolution + within * self.resolution + (self.x, self.y)


class Grid:
    """Square cells of ``resolution`` m, in the map frame, which become more as they are needed.

    A cell holds the logarithm of the odds that it is occupied, in whole steps of ``UNIT``.

    Attributes:
        cells: (rows along y, columns along x) int8.
        echoes: (rows, columns, 3) uint16: sum of x, sum of y, and number of the first echoes in each cell.
            x and y are from the cell's corner, in parts of a cell.
        x, y: outer corner (m) of cell (0, 0).
    """

    def __init__(self, resolution: float, centre: tuple[float, float], size: float, largest: float) -> None:
        """Lay an unknown square of ``size`` m around a place. It becomes ``largest`` m wide at most, in whole cells."""
        self.resolution = resolution
        count = max(1, math.ceil(min(size, largest) / resolution))
        self.cells: Cells = np.zeros((count, count), np.int8)
        self.echoes: Echoes = np.zeros((count, count, 3), np.uint16)
        self.x = (round(centre[0] / resolution) - count // 2) * resolution
        self.y = (round(centre[1] / resolution) - count // 2) * resolution
        # Rounded as the first square, which may be as large.
        self._most = max(1, math.ceil(largest / resolution))

    @property
    def known_area(self) -> float:
        """Ground (m²) that something was learnt of."""
        return int(np.count_nonzero(self.cells)) * self.resolution**2

    def per_cent(self) -> Cells:
        """Return the occupancy in per cent, -1 where unknown."""
        return _PER_CENT[self.cells.astype(np.int16) + 128]

    def window(self, x: float, y: float, reach: float) -> Window:
        """Return the part of the grid within ``reach`` m of a place to either side; it may be empty."""
        rows, columns = self.cells.shape
        first_column = min(max(0, math.floor((x - reach - self.x) / self.resolution)), columns)
        first_row = min(max(0, math.floor((y - reach - self.y) / self.resolution)), rows)
        last_column = max(first_column, math.ceil((x + reach - self.x) / self.resolution))
        last_row = max(first_row, math.ceil((y + reach - self.y) / self.resolution))
        part = (slice(first_row, last_row), slice(first_column, last_column))
        return Window(
            self.cells[part],
            self.echoes[part],
            self.x + first_column * self.resolution,
            self.y + first_row * self.resolution,
            self.resolution,
        )

    def cover(self, low: tuple[float, float], high: tuple[float, float]) -> bool:
        """Grow, a metre at a time, until a rectangle (m) lies on the grid; return whether it now does."""
        rows, columns = self.cells.shape
        left, right, fits_x = self._missing(self.x, columns, low[0], high[0])
        below, above, fits_y = self._missing(self.y, rows, low[1], high[1])
        if left or right or below or above:
            self.cells = np.pad(self.cells, ((below, above), (left, right)))
            self.echoes = np.pad(self.echoes, ((below, above), (left, right), (0, 0)))
            self.x -= left * self.resolution
            self.y -= below * self.resolution
        return fits_x and fits_y

    def _missing(self, origin: float, count: int, low: float, high: float) -> tuple[int, int, bool]:
        """Return how many cells to add before and behind, and whether that is as many as needed."""
        metre = max(1, round(1.0 / self.resolution))
        before = max(0, math.ceil((origin - low) / self.resolution / metre)) * metre
        behind = max(0, math.ceil((high - origin) / self.resolution / metre - count / metre)) * metre
        room = self._most - count
        added_before = min(before, room)
        added_behind = min(behind, room - added_before)
        return added_before, added_behind, (added_before, added_behind) == (before, behind)

    def fill(self, per_cent: Cells, x: float, y: float) -> None:
        """Become a map of occupancies in per cent (-1 unknown), whose outer corner is at (``x``, ``y``) m.

        Its surfaces are the occupied cells next to free ones. No echo comes from within a wall.

        Raises:
            ValueError: it is wider than the grid may become.
        """
        self._check_size(*per_cent.shape)
        share = np.clip(per_cent.astype(np.float64) / 100.0, 0.03, 0.97)
        steps = np.round(np.log(share / (1.0 - share)) / UNIT).clip(-SUREST, SUREST).astype(np.int8)
        steps[steps == UNKNOWN] = -1
        steps[per_cent < 0] = UNKNOWN
        self.cells, self.x, self.y = steps, x, y
        # Nothing is known of the place within a cell but the middle, and the next echoes shall improve on it.
        middle = np.array([FINE // 2, FINE // 2, 1], np.uint16)
        free = (steps < OCCUPIED) & (steps != UNKNOWN)
        visible = (steps >= OCCUPIED) & binary_dilation(free, np.ones((3, 3), bool))
        self.echoes = np.where(visible[..., None], middle, np.uint16(0))

    def _check_size(self, rows: int, columns: int) -> None:
        if max(rows, columns) > self._most:
            widest = self._most * self.resolution
            size = f"{columns * self.resolution:g} m x {rows * self.resolution:g} m"
            raise ValueError(f"the map is {size} large, must be at most {widest:g} m wide and high")

    def snapshot(self) -> PlainValue:
        """Return the grid as plain data, compressed."""
        return {
            "resolution": self.resolution,
            "origin": [self.x, self.y],
            "shape": list(self.cells.shape),
            "cells": zlib.compress(self.cells.tobytes(), 1),
            "echoes": zlib.compress(self.echoes[self.echoes[..., 2] > 0].astype("<u2").tobytes(), 1),
            "echoed": zlib.compress(np.packbits(self.echoes[..., 2] > 0).tobytes(), 1),
        }

    def restore(self, state: PlainValue) -> None:
        """Become what a snapshot holds.

        Raises:
            ValueError: its cells are of another size or number than stated, or it is wider than the grid may become.
        """
        if not math.isclose(state["resolution"], self.resolution):
            raise ValueError(f"the state has cells of {state['resolution']} m, must be {self.resolution} m")
        rows, columns = state["shape"]
        self._check_size(rows, columns)
        cells = np.frombuffer(zlib.decompress(state["cells"]), np.int8)
        echoed = np.unpackbits(np.frombuffer(zlib.decompress(state["echoed"]), np.uint8), count=rows * columns)
        echoes = np.frombuffer(zlib.decompress(state["echoes"]), "<u2").reshape(-1, 3)
        self.cells = cells.reshape(rows, columns).copy()
        self.echoes = np.zeros((rows, columns, 3), np.uint16)
        self.echoes[echoed.reshape(rows, columns).astype(bool)] = echoes
        self.x, self.y = map(float, state["origin"])
