"""A scan of the surroundings out of one depth image, by the geometry of a pinhole camera."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray

MAX_PER_COLUMN: Final = 4
"""Directions that are looked at for each column of the image at the most."""

Floats = NDArray[np.float32]


class BadView(ValueError):
    """A camera whose view makes no scan; the text states why."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The view of a camera, from its place.

    ``axes`` (3, 3) has the camera's forward, left and up as columns, in a frame whose z points up. ``height`` (m) is
    that above the floor. ``opening`` (rad) is the horizontal field of view, ``size`` the image's (height, width).
    """

    axes: FloatArray
    height: float
    opening: float
    size: tuple[int, int]

    @property
    def yaw(self) -> float:
        """The heading (rad) of the optical axis, seen from above."""
        return math.atan2(self.axes[1, 0], self.axes[0, 0])


class DepthScan:
    """Makes scans out of the depth images of one view.

    The scan lies level at the camera's place, and its x axis has the camera's heading. Its beams divide the bearings
    that all rows of the image see. Beam i takes the pixels of its width in all rows: the nearest point counts.

    Attributes:
        angle_min: bearing (rad) of the middle of the first beam, that at the right.
        angle_increment: width (rad) of a beam.
    """

    def __init__(self, view: View, beams: int, band: tuple[float, float], reach: tuple[float, float]) -> None:
        """Prepare for a view.

        ``beams`` of 0 are as many as the image has columns. ``band`` is the lowest and highest point (m above the
        floor) that counts, ``reach`` the smallest and largest range (m). Raises BadView.
        """
        self._view = view
        self._band = band
        self._reach = reach
        self._level = _turned(view.axes, -view.yaw)
        rows, columns = view.size
        slope = math.tan(view.opening / 2)
        # A point of depth 1 lies at (1, -across, -down) along forward, left and up.
        self._down = (np.arange(rows) + 0.5 - rows / 2) * (2.0 * slope / columns)
        self._slope = slope
        low, high = self._bearings_of_all_rows()
        self.beams = beams or columns
        self.angle_increment = (high - low) / self.beams
        self.angle_min = low + self.angle_increment / 2
        self._prepare(low)

    def _bearings_of_all_rows(self) -> tuple[float, float]:
        edges = np.tile([self._slope, -self._slope], (len(self._down), 1))
        forward, left, _ = self._directions(edges)
        if (forward <= 0.0).any():
            raise BadView("the camera must look ahead, but parts of its view look straight up, down or back")
        # A camera may hang upside down, so that its left is on the right.
        bearings = np.arctan2(left, forward)
        low, high = float(bearings.min(axis=1).max()), float(bearings.max(axis=1).min())
        if low >= high:
            raise BadView("the camera is tilted so far to its side that its rows have no bearing in common")
        return low, high

    def _directions(self, across: FloatArray) -> FloatArray:
        """Return (3, ...) level directions of the pixels ``across`` (rows, ...) for each metre of depth."""
        down = self._down.reshape(-1, *(1,) * (across.ndim - 1))
        forward, left, up = self._level.T
        shape = (3, *(1,) * across.ndim)
        found: FloatArray = forward.reshape(shape) - left.reshape(shape) * across - up.reshape(shape) * down
        return found

    def _prepare(self, low: float) -> None:
        """Find the pixel of each direction in each row: so many to a beam that no column is left out."""
        middle = self._view.size[1] / 2
        samples, most = 1, math.ceil(MAX_PER_COLUMN * self._view.size[1] / self.beams)
        while True:
            offsets = (np.arange(self.beams * samples, dtype=np.float64) + 0.5) * (self.angle_increment / samples)
            across = self._across(low + offsets)
            position = (across / self._slope + 1.0) * middle
            ends = (self._across(np.array([low, low + self.beams * self.angle_increment])) / self._slope + 1.0) * middle
            steps = np.diff(np.column_stack([ends[:, 0], position, ends[:, 1]]), axis=1)
            widest = float(np.abs(steps).max())
            if widest <= 1.0 or samples >= most:
                break
            samples = min(max(math.ceil(samples * widest), samples + 1), most)
        forward, left, up = self._directions(across)
        columns = np.clip(np.floor(position), 0, self._view.size[1] - 1).astype(np.intp)
        self._pixels = columns + self._view.size[1] * np.arange(self._view.size[0])[:, None]
        self._outward = np.hypot(forward, left).astype(np.float32)
        self._upward = up.astype(np.float32)
        self._samples = samples

    def _across(self, bearings: FloatArray) -> FloatArray:
        """Return where (rows, N) in the image a row sees a bearing (N)."""
        # The direction has nothing along the normal of the upright plane at that bearing.
        normal = np.stack([-np.sin(bearings), np.cos(bearings), np.zeros_like(bearings)])
        forward, left, up = self._level.T @ normal
        across: FloatArray = (forward - self._down[:, None] * up) / left
        return across

    def ranges(self, depths: Floats) -> Floats:
        """Return the ranges (beams; m) of an image of depths (height, width; m).

        A range is the planar distance from the camera. It is +inf where no point in the band is within reach. It is
        -inf where something in the band is too near to be measured (REP 117). A point nearer than the camera measures
        counts if its ray is still in the band at the smallest range: what is below may be the floor.
        """
        lowest, highest = self._band
        nearest, farthest = self._reach
        seen = depths.ravel()[self._pixels]
        with np.errstate(invalid="ignore"):
            planar = seen * self._outward
            height = self._view.height + seen * self._upward
        counts = (height >= lowest) & (height <= highest) & (planar <= farthest)
        found = np.where(counts, np.where(planar < nearest, -np.inf, planar), np.inf)
        height_when_near = self._view.height + nearest * self._upward
        too_near = np.isneginf(seen) & (height_when_near >= lowest) & (height_when_near <= highest)
        found[too_near] = -np.inf
        ranges: Floats = found.min(axis=0).reshape(self.beams, self._samples).min(axis=1).astype(np.float32)
        return ranges


def _turned(axes: FloatArray, yaw: float) -> FloatArray:
    cos, sin = math.cos(yaw), math.sin(yaw)
    turned: FloatArray = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ axes
    return turned


def axes_of(x: float, y: float, z: float, w: float) -> FloatArray:
    """Return the axes (3, 3) of a unit quaternion, as columns."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
