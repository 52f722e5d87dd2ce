"""The robot's knowledge of the ground: where it can stand, how far the ways are, what it would see from there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, distance_transform_edt, label  # type: ignore[import-untyped, unused-ignore]
from scipy.sparse import csr_array  # type: ignore[import-untyped, unused-ignore]
from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped, unused-ignore]

from regraft.planar import FloatArray, Point
from regraft.services.navigator.planning.grid import OccupancyGrid

Mask = NDArray[np.bool_]
Cells = NDArray[np.intp]
"""(N, 2): row and column of each cell."""

EIGHT = np.ones((3, 3), bool)
LEAVE_TIMEOUT = 0.10
"""m beyond its radius that a robot may be too close to something, and still find a way out."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A map as seen by a robot at a place in it; all arrays are (rows, columns).

    `free` and `unknown` are the cells known to hold nothing and those not known. `walls` are the occupied ones with the
    gaps of one or two cells closed that noise leaves. `clearance` (m) is how far a cell's centre is from the nearest
    occupied cell's edge. `room` counts unknown cells as occupied. `reachable` is where the robot's centre can get to
    over known ground.
    """

    grid: OccupancyGrid
    start: tuple[int, int]
    free: Mask
    unknown: Mask
    walls: Mask
    clearance: FloatArray
    room: FloatArray
    allowed: Mask
    reachable: Mask

    @classmethod
    def of(cls, grid: OccupancyGrid, robot: Point, radius: float) -> Self:
        """Look at a map from where the robot stands (m), which is of this radius (m).

        Raises:
            ValueError: the robot stands beyond the map.
        """
        if not grid.contains(robot):
            raise ValueError(f"the robot at ({robot[0]:.2f}, {robot[1]:.2f}) is off the map: {grid.extent()}")
        occupied, start = grid.occupied, grid.cell_of(robot)
        rows, columns = np.ogrid[: occupied.shape[0], : occupied.shape[1]]
        away = np.hypot(rows - start[0], columns - start[1]) * grid.resolution
        # Where the robot stands there is ground, even if its lidar cannot see so near.
        unknown = (grid.cells < 0) & (away > radius)
        free = ~(occupied | unknown)
        clearance = _distance_to(occupied, grid.resolution)
        allowed = free & ((clearance >= radius) | (away <= radius + LEAVE_TIMEOUT))
        allowed[start] = True
        regions, _ = label(allowed)
        walls = occupied | binary_closing(occupied, EIGHT)
        room = _distance_to(~free, grid.resolution)
        reachable = (regions == regions[start]) & (clearance >= radius)
        return cls(grid, start, free, unknown, walls, clearance, room, allowed, reachable)

    def ways(self, sources: Cells) -> FloatArray:
        """Return how long (m) the ways from each of N cells to all cells are, (N, rows, columns); inf if none."""
        allowed = self.allowed
        number = np.full(allowed.shape, -1, np.int32)
        number[allowed] = np.arange(np.count_nonzero(allowed), dtype=np.int32)
        graph = _links(allowed, number, self.grid.resolution)
        lengths = np.full((len(sources), *allowed.shape), math.inf)
        lengths[:, allowed] = dijkstra(graph, directed=False, indices=number[sources[:, 0], sources[:, 1]])
        return lengths

    def sees(self, eyes: FloatArray, targets: FloatArray, opaque: Mask | None = None) -> Mask:
        """Return for each of K places whether it sees its target, both (K, 2) in (row, column).

        Nothing is seen behind `opaque`, which is `walls` if left out; what is not known hides nothing.
        """
        blocked = self.walls if opaque is None else opaque
        ways = targets - eyes
        # Two looks per cell: what is thinner than a cell is not on the map.
        looks = 2 * math.ceil(float(np.abs(ways).max(initial=0.5))) + 1
        fractions = np.linspace(0.0, 1.0, looks)[:, None, None]
        at = np.rint(eyes + fractions * ways).astype(np.intp)
        rows = at[..., 0].clip(0, blocked.shape[0] - 1)
        columns = at[..., 1].clip(0, blocked.shape[1] - 1)
        seen: Mask = ~blocked[rows, columns].any(axis=0)
        return seen

    def within(self, point: Point, radius: float) -> Mask:
        """Return the mask of the cells whose middles lie within a radius of a point (m)."""
        rows, columns = np.ogrid[: self.free.shape[0], : self.free.shape[1]]
        x = self.grid.origin_x + (columns + 0.5) * self.grid.resolution - point[0]
        y = self.grid.origin_y + (rows + 0.5) * self.grid.resolution - point[1]
        near: Mask = np.hypot(x, y) < radius
        return near

    def point(self, cell: tuple[int, int]) -> Point:
        """Return the centre (m) of a cell."""
        ((x, y),) = self.grid.centres(np.array([cell[0]]), np.array([cell[1]])).tolist()
        return (x, y)

    def known_area(self) -> float:
        """Return how much ground (m²) is known to be free."""
        return float(np.count_nonzero(self.free)) * self.grid.resolution**2


def _distance_to(mask: Mask, resolution: float) -> FloatArray:
    """Return the distance (m) of each cell's centre to the edge of the nearest cell of a mask."""
    if not mask.any():
        return np.full(mask.shape, math.inf)
    distance: FloatArray = (distance_transform_edt(~mask) - 0.5) * resolution
    return distance


def _links(allowed: Mask, number: NDArray[np.int32], resolution: float) -> csr_array:
    """Return the lengths (m) of the steps between neighbouring allowed cells; none cuts a corner."""
    first, second, whole = slice(None, -1), slice(1, None), slice(None)
    straight = [((whole, first), (whole, second)), ((first, whole), (second, whole))]
    diagonal = [((first, first), (second, second)), ((first, second), (second, first))]
    ends: list[tuple[NDArray[np.int32], NDArray[np.int32], float]] = []
    for here, there in straight:
        possible = allowed[here] & allowed[there]
        ends.append((number[here][possible], number[there][possible], resolution))
    square = allowed[:-1, :-1] & allowed[1:, 1:] & allowed[:-1, 1:] & allowed[1:, :-1]
    ends += [(number[here][square], number[there][square], resolution * math.sqrt(2)) for here, there in diagonal]
    lengths = np.concatenate([np.full(len(here), length) for here, _, length in ends])
    rows, columns = (np.concatenate([end[i] for end in ends]) for i in (0, 1))
    count = int(number.max()) + 1
    return csr_array((lengths, (rows, columns)), shape=(count, count))
