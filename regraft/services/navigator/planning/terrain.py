"""The cost for a robot's centre of being anywhere on a map."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt  # type: ignore[import-untyped, unused-ignore]

from regraft.planar import FloatArray
from regraft.services import robot_parameters as usual
from regraft.services.navigator.planning.grid import OccupancyGrid

# Driving at the lethal radius counts as this many times the length of driving in the open. It counts less towards the
# inflation radius: 0.3 m of detour are worth 0.1 m more of clearance.
NEAR_OBSTACLE = 8.0
# Prefer known ground, but take a short cut through the unknown where the known way is much longer.
UNKNOWN = 1.0
BEYOND = 1.0  # m around what is known where a way may run
FADING = 2.5  # radii of the robot: where obstacles begin to cost


@dataclass(frozen=True, slots=True)
class Inflation:
    """How far obstacles reach: no path closer than `lethal` (m), costs fade out at `fades` (m).

    A robot can turn in place where the nearest obstacle is `turning` (m) away.
    """

    lethal: float = usual.RADIUS
    fades: float = FADING * usual.RADIUS
    turning: float = usual.TURNING_ROOM

    def __post_init__(self) -> None:
        if not 0.0 < self.lethal <= self.fades:
            raise ValueError(f"need 0 < lethal <= fades, not lethal {self.lethal} m, fades {self.fades} m")

    @classmethod
    def of(cls, radius: float, turning_room: float) -> Self:
        """Return what a robot of a radius (m) needs that turns where it has some room (m)."""
        return cls(radius, FADING * radius, turning_room)


@dataclass(frozen=True, slots=True, eq=False)
class Terrain:
    """A grid with its clearances (m, from a cell's centre to the nearest obstacle's edge) and costs.

    All arrays are (rows, columns). `cost` is the extra length paid for each metre of way; `free` is where
    a path may run, `open` where at least no obstacle is. The area beyond the map is neither. `explored` spans
    the rows and columns around all that is known: there is hardly ever a reason to leave it.
    """

    grid: OccupancyGrid
    clearance: FloatArray
    cost: FloatArray
    free: NDArray[np.bool_]
    open: NDArray[np.bool_]
    explored: tuple[slice, slice]

    @classmethod
    def of(cls, grid: OccupancyGrid, inflation: Inflation, obstacles: FloatArray, cross_unknown: bool) -> Self:
        """Inflate the map's obstacles and the (N, 2) points `obstacles` (m) that are not on the map."""
        occupied = grid.occupied
        occupied[grid.cells_of(grid.on_map(obstacles))] = True
        clearance = np.full(occupied.shape, math.inf)
        if occupied.any():
            # From centre to centre; half a cell less is where the obstacle's cell begins.
            clearance = (distance_transform_edt(~occupied) - 0.5) * grid.resolution
        unknown = grid.cells < 0
        open_ = ~occupied if cross_unknown else ~(occupied | unknown)
        nearness = np.clip((inflation.fades - clearance) / max(inflation.fades - inflation.lethal, 1e-9), 0.0, 1.0)
        cost = NEAR_OBSTACLE * nearness**2 + UNKNOWN * unknown
        # Inside the lethal radius (only where start or goal are) the shortest way out is the best.
        cost[clearance < inflation.lethal] += 3 * NEAR_OBSTACLE
        free = open_ & (clearance >= inflation.lethal)
        return cls(grid, clearance, cost, free, open_, _explored(~unknown, math.ceil(BEYOND / grid.resolution)))

    @property
    def free_explored(self) -> NDArray[np.bool_]:
        """Where a path may run that does not go far into the unknown."""
        mask = np.zeros_like(self.free)
        mask[self.explored] = self.free[self.explored]
        return mask

    def is_explored(self, cell: tuple[int, int]) -> bool:
        """Return whether a cell lies within what is explored."""
        return all(part.start <= index < part.stop for part, index in zip(self.explored, cell, strict=True))

    def around(self, centre: tuple[int, int], radius: float) -> NDArray[np.bool_]:
        """Return the mask of the cells without obstacle within `radius` (m) of a cell."""
        rows, columns = np.ogrid[: self.open.shape[0], : self.open.shape[1]]
        near = np.hypot(rows - centre[0], columns - centre[1]) * self.grid.resolution <= radius
        mask: NDArray[np.bool_] = near & self.open
        return mask


def _explored(known: NDArray[np.bool_], beyond: int) -> tuple[slice, slice]:
    """Return the rows and columns of what is known, and so many more to each side."""
    spans = []
    for axis, size in enumerate(known.shape):
        found = np.flatnonzero(known.any(axis=1 - axis))
        first, last = (int(found[0]), int(found[-1])) if len(found) else (0, size - 1)
        spans.append(slice(max(0, first - beyond), min(size, last + 1 + beyond)))
    return spans[0], spans[1]


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """The part of a terrain on which one path may run: the cells that are `allowed` (rows, columns)."""

    terrain: Terrain
    allowed: NDArray[np.bool_]

    def straight_costs(self, start: FloatArray, ends: FloatArray) -> FloatArray:
        """Return what the straight ways from (2,) to each of (N, 2) cost in metres; inf if forbidden.

        They are sampled every half cell, so corners can be cut by less than that: see `crossable`.
        """
        ways = ends - start
        lengths = np.hypot(ways[:, 0], ways[:, 1])
        count = max(2, math.ceil(float(lengths.max()) / (self.terrain.grid.resolution / 2)) + 1)
        samples = start + np.linspace(0.0, 1.0, count)[:, None, None] * ways
        costs: FloatArray = lengths * (1.0 + self._costs(samples).mean(axis=0))
        return costs

    def step_costs(self, points: FloatArray) -> FloatArray:
        """Return what each of the N-1 short steps of a polyline (N, 2) costs in metres; inf if forbidden."""
        ways = points[1:] - points[:-1]
        samples = points[:-1] + np.linspace(0.0, 1.0, 5)[:, None, None] * ways
        costs: FloatArray = np.hypot(ways[:, 0], ways[:, 1]) * (1.0 + self._costs(samples).mean(axis=0))
        return costs

    def cost(self, points: FloatArray) -> float:
        """Return what a finely divided polyline (N, 2) costs in metres; inf if it leaves allowed ground."""
        lengths = np.hypot(*np.diff(points, axis=0).T)
        middles = (points[:-1] + points[1:]) / 2
        return float((lengths * (1.0 + self._costs(middles))).sum())

    def crossable(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return for each of the N-1 segments of a polyline (N, 2) whether every cell it crosses is allowed."""
        grid = self.terrain.grid
        cells = (points - np.array([grid.origin_x, grid.origin_y])) / grid.resolution
        starts, ways = cells[:-1], np.diff(cells, axis=0)
        # A segment changes cells where it meets a grid line; between two neighbouring meetings it stays in
        # one cell, that of the point halfway.
        lines = math.ceil(float(np.abs(ways).max(initial=0.0))) + 1
        first = np.floor(np.minimum(starts, starts + ways)) + 1.0
        meetings = first[:, None, :] + np.arange(lines)[None, :, None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            fractions = (meetings - starts[:, None, :]) / ways[:, None, :]
        fractions = np.clip(np.nan_to_num(fractions, nan=0.0), 0.0, 1.0).reshape(len(ways), -1)
        ends = np.broadcast_to(np.array([0.0, 1.0]), (len(ways), 2))
        ordered = np.sort(np.concatenate([fractions, ends], axis=1), axis=1)
        halfway = (ordered[:, :-1] + ordered[:, 1:]) / 2
        between = starts[:, None, :] + halfway[:, :, None] * ways[:, None, :]
        cells_between = np.floor(between).astype(np.intp)
        columns, rows = cells_between[..., 0], cells_between[..., 1]
        height, width = self.allowed.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        allowed = inside & self.allowed[rows.clip(0, height - 1), columns.clip(0, width - 1)]
        crossed: NDArray[np.bool_] = np.asarray(allowed.all(axis=1))
        return crossed

    def _costs(self, points: FloatArray) -> FloatArray:
        rows, columns = self.terrain.grid.cells_of(points)
        height, width = self.allowed.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        cells = rows * width + columns
        if not inside.all():
            cells = np.where(inside, cells, 0)
        passable = inside & self.allowed.ravel()[cells]
        costs: FloatArray = np.where(passable, self.terrain.cost.ravel()[cells], np.inf)
        return costs
