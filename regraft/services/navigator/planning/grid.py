"""Occupancy grids."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray, Point

# Nav2's map server calls a cell occupied from 65 % on.
OCCUPIED_FROM = 65


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """A map of square cells.

    `cells` (rows, columns) int8: 0 free to 100 occupied, -1 unknown; rows run along y, columns along x.
    `resolution` is a cell's side in m; (`origin_x`, `origin_y`) is the outer corner of cell (0, 0) in m.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin_x: float
    origin_y: float

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or not self.cells.size:
            raise ValueError(f"cells must be a filled array of rows and columns, not {self.cells.shape}")
        if not self.resolution > 0.0:
            raise ValueError(f"resolution must be greater than 0 m, not {self.resolution}")

    @property
    def occupied(self) -> NDArray[np.bool_]:
        """Where an obstacle is known to be, (rows, columns)."""
        mask: NDArray[np.bool_] = self.cells >= OCCUPIED_FROM
        return mask

    def contains(self, point: Point) -> bool:
        """Return whether a point (m) lies on the map."""
        row, column = self.cell_of(point)
        rows, columns = self.cells.shape
        inside: bool = 0 <= row < rows and 0 <= column < columns
        return inside

    def cell_of(self, point: Point) -> tuple[int, int]:
        """Return (row, column) of the cell under a point (m); it may lie outside the map."""
        rows, columns = self.cells_of(np.array([point]))
        return int(rows[0]), int(columns[0])

    def cells_of(self, points: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns of the cells under points (..., 2); they may lie outside the map."""
        columns = np.floor((points[..., 0] - self.origin_x) / self.resolution).astype(np.intp)
        rows = np.floor((points[..., 1] - self.origin_y) / self.resolution).astype(np.intp)
        return rows, columns

    def covers(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which of (N, 2) points lie on the map."""
        rows, columns = self.cells_of(points)
        inside: NDArray[np.bool_] = (
            (rows >= 0) & (rows < self.cells.shape[0]) & (columns >= 0) & (columns < self.cells.shape[1])
        )
        return inside

    def on_map(self, points: FloatArray) -> FloatArray:
        """Return those of (N, 2) points that lie on the map."""
        kept: FloatArray = points[self.covers(points)]
        return kept

    def centres(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> FloatArray:
        """Return the centres (N, 2) of cells in m."""
        return np.column_stack(
            [
                self.origin_x + (columns + 0.5) * self.resolution,
                self.origin_y + (rows + 0.5) * self.resolution,
            ]
        )

    def occupied_within(self, point: Point, reach: float) -> FloatArray:
        """Return the centres (N, 2) of the occupied cells within `reach` (m) of a point (m)."""
        row, column = self.cell_of(point)
        cells = int(reach / self.resolution) + 1
        first_row, first_column = max(row - cells, 0), max(column - cells, 0)
        window = self.cells[first_row : max(row + cells + 1, 0), first_column : max(column + cells + 1, 0)]
        rows, columns = np.nonzero(window >= OCCUPIED_FROM)
        centres = self.centres(rows + first_row, columns + first_column)
        near: FloatArray = centres[np.hypot(centres[:, 0] - point[0], centres[:, 1] - point[1]) <= reach]
        return near

    def extent(self) -> str:
        """Describe in words what the map spans, for error messages."""
        rows, columns = self.cells.shape
        return (
            f"x {self.origin_x:.2f} to {self.origin_x + columns * self.resolution:.2f} m, "
            f"y {self.origin_y:.2f} to {self.origin_y + rows * self.resolution:.2f} m"
        )
