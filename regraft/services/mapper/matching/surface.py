"""The surfaces that a map holds, as points with the directions in which they run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from regraft.planar import FloatArray
from regraft.services.mapper.maps.grid import OCCUPIED, UNKNOWN, Window

BLUR = 1.0
"""Cells (standard deviation) by which the occupied ones are blurred before their edges are looked for."""
NEIGHBOURHOOD = 1.5
"""Cells (standard deviation) around a point over which the directions of edges are averaged."""
STRAIGHT = 0.02
"""Least weight along a surface against that across it: a wall does not determine where along it the robot is."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """FloatArray (n, 2; m) of a map's surfaces.

    ``weights`` (n, 3) are the entries xx, xy, yy of the matrix by which a miss of each point counts. It is 1 across the
    surface, and along it the less, the straighter it is.
    """

    points: FloatArray
    weights: FloatArray
    tree: cKDTree
    window: Window

    @classmethod
    def of(cls, window: Window) -> Surface:
        """Find the surfaces in a part of a map."""
        cells = window.surface_cells()
        points = window.surface(cells)
        tree = cKDTree(points, leafsize=16, balanced_tree=False, compact_nodes=False)
        return cls(points, _weights(window, *cells), tree, window)

    def knows(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return for places (n, 2; m) whether something was learnt of their cells."""
        window = self.window
        rows, columns = window.cells.shape
        column = np.floor((points[:, 0] - window.x) / window.resolution).astype(np.intp)
        row = np.floor((points[:, 1] - window.y) / window.resolution).astype(np.intp)
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        known = np.zeros(len(points), bool)
        known[inside] = window.cells[row[inside], column[inside]] != UNKNOWN
        return known


def _weights(window: Window, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> FloatArray:
    """Return the weights of the surface's points by the structure tensor of the occupied cells around each.

    It is as straight along a thick wall as along a thin one.
    """
    if not len(rows):
        return np.empty((0, 3))
    blurred = gaussian_filter((window.cells >= OCCUPIED).astype(np.float32), BLUR, mode="nearest")
    up, right = np.gradient(blurred)
    xx, xy, yy = (
        gaussian_filter(product, NEIGHBOURHOOD, mode="nearest")[rows, columns].astype(np.float64)
        for product in (right * right, right * up, up * up)
    )
    middle, spread = (xx + yy) / 2.0, np.maximum(np.hypot((xx - yy) / 2.0, xy), 1e-12)
    along = ((middle - spread) / (middle + spread)).clip(STRAIGHT, 1.0)
    # The tensor's larger axis lies across the surface. Its outer product follows from the doubled angle.
    cos, sin = (xx - yy) / 2.0 / spread, xy / spread
    more = (1.0 - along) / 2.0
    return np.column_stack([along + more * (1.0 + cos), more * sin, along + more * (1.0 - cos)])
