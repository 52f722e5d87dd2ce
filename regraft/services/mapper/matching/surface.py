"""The surfaces that a map holds, as points with the directions in which they run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from regraft.planar import FloatArray
from regraft.services.mapper.maps.grid import UNKNOWN, Window

NEIGHBOURS = 5
NEIGHBOURHOOD = 2.5
"""Cells around a point in which its neighbours are looked for."""
STRAIGHT = 0.02
"""Least weight along a surface against that across it: a wall says nothing of where along it one is."""


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
        points = window.surface()
        tree = cKDTree(points, leafsize=16, balanced_tree=False, compact_nodes=False)
        return cls(points, _weights(points, tree, NEIGHBOURHOOD * window.resolution), tree, window)

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


def _weights(points: FloatArray, tree: cKDTree, reach: float) -> FloatArray:
    """Return the weights of points from how their neighbours lie: by the axes of their scatter."""
    if len(points) < NEIGHBOURS:
        return np.tile([1.0, 0.0, 1.0], (len(points), 1))
    distances, neighbours = tree.query(points, NEIGHBOURS, distance_upper_bound=reach)
    there = np.isfinite(distances)
    count = there.sum(axis=1)
    near = points[np.where(there, neighbours, 0)]
    mean = (near * there[..., None]).sum(axis=1) / count[:, None]
    x, y = ((near - mean[:, None, :]) * there[..., None]).transpose(2, 0, 1)
    xx, xy, yy = (x * x).sum(axis=1), (x * y).sum(axis=1), (y * y).sum(axis=1)
    middle, spread = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
    thin = (count >= 3) & (middle > 0.0)
    along = np.where(thin, (middle - spread) / np.maximum(middle + spread, 1e-12), 1.0).clip(STRAIGHT, 1.0)
    # The direction along the surface is that of the largest scatter: its outer product from the doubled angle.
    spread = np.maximum(spread, 1e-12)
    cos, sin = (xx - yy) / 2.0 / spread, xy / spread
    tangent_xx, tangent_xy, tangent_yy = (1.0 + cos) / 2.0, sin / 2.0, (1.0 - cos) / 2.0
    less = 1.0 - along
    return np.column_stack([1.0 - less * tangent_xx, -less * tangent_xy, 1.0 - less * tangent_yy])
