"""Where the objects of a world really are, read off its true map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.maps import Goals, OccupancyGrid
from regraft.evaluation.map_quality import OCCUPIED_FROM

FARTHEST = 3.0
"""m ahead of a viewing pose within which its object is."""
BEFORE = 1.3
"""m from an object's outline within which one stands before it, ..."""
FACING = 0.3
"""... and rad to either side within which its middle is straight ahead."""


@dataclass(frozen=True, slots=True, eq=False)
class TrueObject:
    """An object: the middles (n, 2; m, map frame) of the cells that it covers."""

    name: str
    cells: NDArray[np.float64]

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of its outline's box (m)."""
        low, high = self.cells.min(axis=0), self.cells.max(axis=0)
        x, y = ((low + high) / 2.0).tolist()
        return x, y

    def is_faced_from(self, pose: Pose) -> bool:
        """Return whether a robot at a pose (map) stands before it and looks at it."""
        distance = float(np.hypot(*(self.cells - (pose.x, pose.y)).T).min())
        x, y = self.middle
        ahead = math.atan2(y - pose.y, x - pose.x)
        return distance <= BEFORE and abs(math.remainder(ahead - pose.yaw, math.tau)) <= FACING


def true_objects(grid: OccupancyGrid, goals: Goals) -> tuple[TrueObject, ...]:
    """Return the objects that a world's viewing goals look at: what is first hit straight ahead of each.

    Raises:
        ValueError: nothing stands ahead of a goal.
    """
    regions, _ = label(grid.cells >= OCCUPIED_FROM, np.ones((3, 3), int))
    return tuple(TrueObject(goal.name, _cells(grid, regions, goal.pose.pose, goal.name)) for goal in goals.goals)


def _cells(grid: OccupancyGrid, regions: NDArray[np.int32], pose: Pose, name: str) -> NDArray[np.float64]:
    rows, columns = regions.shape
    for distance in np.arange(0.0, FARTHEST, grid.resolution / 2):
        x = pose.x + distance * math.cos(pose.yaw) - grid.origin.x
        y = pose.y + distance * math.sin(pose.yaw) - grid.origin.y
        column, row = math.floor(x / grid.resolution), math.floor(y / grid.resolution)
        if not (0 <= row < rows and 0 <= column < columns):
            break
        if regions[row, column]:
            found = np.argwhere(regions == regions[row, column])[:, ::-1]
            return np.asarray((found + 0.5) * grid.resolution + (grid.origin.x, grid.origin.y), np.float64)
    raise ValueError(f"nothing stands ahead of the goal of {name!r}")
