"""The likelihood field: how well an echo at a place would fit the map, from far away.

S. Thrun, W. Burgard, D. Fox: Probabilistic Robotics, section 6.4; here the occupied cells, blurred by a Gaussian.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from regraft.services.mapper.maps.grid import OCCUPIED, Window

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """Values (rows, columns) of a window's cells: 1 in a straight wall of one cell, 0 far from any."""

    values: NDArray[np.float32]
    x: float
    y: float
    resolution: float

    @classmethod
    def of(cls, window: Window, blur: float) -> Field:
        """Blur the occupied cells of a window by a standard deviation of ``blur`` m."""
        sigma = blur / window.resolution
        # In one direction a long wall is as it was; across it, only the middle of the kernel is left.
        middle = 1.0 / np.exp(-0.5 * (np.arange(-20, 21) / sigma) ** 2).sum()
        occupied = (window.cells >= OCCUPIED).astype(np.float32)
        values = gaussian_filter(occupied, sigma, mode="constant", truncate=3.0) / np.float32(middle)
        return cls(np.minimum(values, np.float32(1.0)), window.x, window.y, window.resolution)

    def at(self, x: FloatArray, y: FloatArray) -> NDArray[np.float32]:
        """Return the values at places (m), 0 outside the window."""
        rows, columns = self.values.shape
        column = np.floor((x - self.x) / self.resolution).astype(np.int32)
        row = np.floor((y - self.y) / self.resolution).astype(np.int32)
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        index = np.where(inside, row * columns + column, 0)
        return np.where(inside, self.values.reshape(-1)[index], np.float32(0.0))
