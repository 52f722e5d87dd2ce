"""The cost of being at a place, as Nav2's costmaps have it: 0 is free, 254 an obstacle, 255 unknown.

The scale is that of nav2_costmap_2d's cost values, with an inflation that falls in a straight line.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from regraft.planar import FloatArray, Pose2D
from regraft.services.navigator.driving.robot import Footprint
from regraft.services.navigator.planning.terrain import Terrain

UNKNOWN: Final = 255.0
LETHAL: Final = 254.0
INSCRIBED: Final = 253.0
"""The robot touches something whichever way it faces."""
FARTHEST: Final = 252.0
MARGIN: Final = 0.027
"""m beyond the half width: a nearer obstacle makes a path invalid, as for the navigator."""
BORDER: Final = 0.04
"""m between the points of an outline that are looked at."""
TOLERANCE: Final = 0.75 * BORDER
"""m around a rounded corner in which points are looked at as well: none lie on its arc."""


def costs_of(points: FloatArray, terrain: Terrain, half_width: float, fades: float) -> FloatArray:
    """Return the cost at each of (N, 2) points; a place beyond the map is unknown.

    ``half_width`` (m) is how far the robot reaches to each side. An obstacle farther than ``fades`` (m) has no cost.
    """
    grid = terrain.grid
    rows, columns = grid.cells_of(points)
    height, width = grid.cells.shape
    on_map = grid.covers(points)
    cells = (rows.clip(0, height - 1), columns.clip(0, width - 1))
    clearance = terrain.clearance[cells]
    inscribed = half_width + MARGIN
    nearness = np.clip((fades - clearance) / max(fades - inscribed, 1e-9), 0.0, 1.0)
    found = np.where(nearness > 0.0, np.maximum(np.ceil(FARTHEST * nearness), 1.0), 0.0)
    found = np.where(clearance < inscribed, INSCRIBED, found)
    found = np.where(clearance <= 0.0, LETHAL, found)
    unknown = ~on_map | ((grid.cells[cells] < 0) & (clearance > 0.0))
    result: FloatArray = np.where(unknown, UNKNOWN, found)
    return result


def footprint_cost(pose: Pose2D, footprint: Footprint, terrain: Terrain) -> float:
    """Return `LETHAL` where the outline at ``pose`` lies over an obstacle, `UNKNOWN` over unknown ground, or 0."""
    points = pose.outward(_points_within(footprint))
    grid = terrain.grid
    if not grid.covers(points).all():
        return UNKNOWN
    cells = grid.cells_of(points)
    if (terrain.clearance[cells] <= 0.0).any():
        return LETHAL
    return UNKNOWN if (grid.cells[cells] < 0).any() else 0.0


def _points_within(footprint: Footprint) -> FloatArray:
    xs = np.arange(-footprint.rear, footprint.front + BORDER, BORDER).clip(max=footprint.front)
    ys = np.arange(-footprint.half_width, footprint.half_width + BORDER, BORDER).clip(max=footprint.half_width)
    x, y = (each.ravel() for each in np.meshgrid(xs, ys))
    rounding = footprint.rounding
    beyond_x = np.abs(x - footprint.centre) - (footprint.front + footprint.rear) / 2 + rounding
    beyond_y = np.abs(y) - footprint.half_width + rounding
    is_within = np.hypot(beyond_x.clip(min=0.0), beyond_y.clip(min=0.0)) <= rounding + TOLERANCE
    return np.column_stack([x[is_within], y[is_within]])
