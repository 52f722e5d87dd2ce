"""The cost for a robot's centre of being anywhere on a map."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
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

    Obstacles that the map lacks count in `clearance` only up to the distance at which costs fade out.
    """

    grid: OccupancyGrid
    inflation: Inflation
    clearance: FloatArray
    cost: FloatArray
    free: NDArray[np.bool_]
    open: NDArray[np.bool_]
    explored: tuple[slice, slice]

    @classmethod
    def of(cls, grid: OccupancyGrid, inflation: Inflation, cross_unknown: bool) -> Self:
        """Inflate the map's obstacles."""
        occupied = grid.occupied
        clearance = np.full(occupied.shape, math.inf)
        if occupied.any():
            clearance = _clearance(distance_transform_edt(~occupied), grid.resolution)
        unknown = grid.cells < 0
        open_ = ~occupied if cross_unknown else ~(occupied | unknown)
        cost = _cost(clearance, unknown, inflation)
        free = open_ & (clearance >= inflation.lethal)
        explored = _explored(~unknown, math.ceil(BEYOND / grid.resolution))
        return cls(grid, inflation, clearance, cost, free, open_, explored)

    def with_obstacles(self, cells: NDArray[np.intp]) -> Self:
        """Return the terrain with obstacles in more cells (N,), which are counted row by row."""
        resolution, inflation = self.grid.resolution, self.inflation
        reach = math.ceil(inflation.fades / resolution + 0.5)
        across = np.arange(-reach, reach + 1)
        around_one = _clearance(np.sqrt(across[:, None] ** 2 + across**2), resolution)
        clearance, cost, free, open_ = self.clearance.copy(), self.cost.copy(), self.free.copy(), self.open.copy()
        rows, columns = np.divmod(cells, clearance.shape[1])
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
            top, left = max(row - reach, 0), max(column - reach, 0)
            near = clearance[top : row + reach + 1, left : column + reach + 1]
            from_here = around_one[top - row + reach :, left - column + reach :]
            np.minimum(near, from_here[: near.shape[0], : near.shape[1]], out=near)
        open_[rows, columns] = False
        nearer = clearance < self.clearance
        cost[nearer] = _cost(clearance[nearer], self.grid.cells[nearer] < 0, inflation)
        free[nearer] = open_[nearer] & (clearance[nearer] >= inflation.lethal)
        return replace(self, clearance=clearance, cost=cost, free=free, open=open_)

    @property
    def free_explored(self) -> NDArray[np.bool_]:
        """Where a path may run that does not go far into the unknown."""
        return self.explored_part(self.free)

    def explored_part(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a mask (rows, columns) without what is far in the unknown."""
        part = np.zeros_like(mask)
        part[self.explored] = mask[self.explored]
        return part

    def is_explored(self, cell: tuple[int, int]) -> bool:
        """Return whether a cell lies within what is explored."""
        return all(part.start <= index < part.stop for part, index in zip(self.explored, cell, strict=True))

    def around(self, centre: tuple[int, int], radius: float) -> NDArray[np.bool_]:
        """Return the mask of the cells without obstacle within `radius` (m) of a cell."""
        window = self.window(centre, radius)
        rows, columns = np.ogrid[window]
        near = np.hypot(rows - centre[0], columns - centre[1]) * self.grid.resolution <= radius
        mask = np.zeros_like(self.open)
        mask[window] = near & self.open[window]
        return mask

    def window(self, centre: tuple[int, int], reach: float) -> tuple[slice, slice]:
        """Return the rows and columns of the map within `reach` (m) of a cell on it, or one more."""
        cells = int(reach / self.grid.resolution) + 1
        first, second = (
            slice(max(index - cells, 0), min(index + cells + 1, size))
            for index, size in zip(centre, self.open.shape, strict=True)
        )
        return first, second


def _clearance(distances: FloatArray, resolution: float) -> FloatArray:
    """Return clearances (m) for distances (cells) to obstacles' centres; their cells begin half a cell before."""
    clearance: FloatArray = (distances - 0.5) * resolution
    return clearance


def _cost(clearance: FloatArray, unknown: NDArray[np.bool_], inflation: Inflation) -> FloatArray:
    """Return the extra length paid for each metre of way, at cells of any shape."""
    nearness = np.clip((inflation.fades - clearance) / max(inflation.fades - inflation.lethal, 1e-9), 0.0, 1.0)
    cost: FloatArray = NEAR_OBSTACLE * nearness**2 + UNKNOWN * unknown
    # Inside the lethal radius (only where start or goal are) the shortest way out is the best.
    cost[clearance < inflation.lethal] += 3 * NEAR_OBSTACLE
    return cost


def _explored(known: NDArray[np.bool_], beyond: int) -> tuple[slice, slice]:
    """Return the rows and columns of what is known, and so many more to each side."""
    spans = []
    for axis, size in enumerate(known.shape):
        found = np.flatnonzero(known.any(axis=1 - axis))
        first, last = (int(found[0]), int(found[-1])) if len(found) else (0, size - 1)
        spans.append(slice(max(0, first - beyond), min(size, last + 1 + beyond)))
    return spans[0], spans[1]


@dataclass(frozen=True, eq=False)
class Ground:
    """The part of a terrain on which one path may run: the cells that are `allowed` (rows, columns)."""

    terrain: Terrain
    allowed: NDArray[np.bool_]

    @cached_property
    def priced(self) -> FloatArray:
        """The costs of the cells, row by row; inf where it is forbidden."""
        priced: FloatArray = np.where(self.allowed, self.terrain.cost, np.inf).ravel()
        return priced

    @cached_property
    def inner(self) -> NDArray[np.bool_]:
        """Where all neighbours are allowed, too."""
        inner = np.zeros_like(self.allowed)
        rows = self.allowed[:-2] & self.allowed[1:-1] & self.allowed[2:]
        inner[1:-1, 1:-1] = rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:]
        return inner

    def straight_costs(self, start: FloatArray, ends: FloatArray) -> FloatArray:
        """Return what the straight ways from (2,) to each of (N, 2) cost in metres; inf if forbidden.

        They are sampled every half cell, so corners can be cut by less than that: see `crossable`.
        """
        ways = ends - start
        lengths = np.hypot(ways[:, 0], ways[:, 1])
        count = max(2, math.ceil(float(lengths.max()) / (self.terrain.grid.resolution / 2)) + 1)
        along = np.linspace(0.0, 1.0, count)[:, None]
        sampled = self._costs(start[0] + along * ways[:, 0], start[1] + along * ways[:, 1])
        costs: FloatArray = lengths * (1.0 + sampled.mean(axis=0))
        return costs

    def step_costs(self, points: FloatArray) -> FloatArray:
        """Return what each of the N-1 short steps of a polyline (N, 2) costs in metres; inf if forbidden."""
        ways = points[1:] - points[:-1]
        samples = points[:-1] + np.linspace(0.0, 1.0, 5)[:, None, None] * ways
        costs: FloatArray = np.hypot(ways[:, 0], ways[:, 1]) * (
            1.0 + self._costs(samples[..., 0], samples[..., 1]).mean(axis=0)
        )
        return costs

    def cost(self, points: FloatArray) -> float:
        """Return what a finely divided polyline (N, 2) costs in metres; inf if it leaves allowed ground."""
        lengths = np.hypot(*np.diff(points, axis=0).T)
        middles = (points[:-1] + points[1:]) / 2
        return float((lengths * (1.0 + self._costs(middles[:, 0], middles[:, 1]))).sum())

    def crossable(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return for each of the N-1 segments of a polyline (N, 2) whether every cell it crosses is allowed."""
        grid = self.terrain.grid
        cells = (points - np.array([grid.origin_x, grid.origin_y])) / grid.resolution
        crossed = self._inner_steps(cells)
        doubtful = np.flatnonzero(~crossed)
        if len(doubtful):
            crossed[doubtful] = self._all_allowed(cells[doubtful], cells[doubtful + 1] - cells[doubtful])
        return crossed

    def _inner_steps(self, cells: FloatArray) -> NDArray[np.bool_]:
        """Return which of the N-1 segments lead from a cell to itself or a neighbour, both far from all forbidden."""
        places = np.floor(cells).astype(np.intp)
        inner = self._is_among(places, self.inner)
        steps: NDArray[np.bool_] = inner[:-1] & inner[1:] & (np.abs(np.diff(places, axis=0)) <= 1).all(axis=1)
        return steps

    def _all_allowed(self, starts: FloatArray, ways: FloatArray) -> NDArray[np.bool_]:
        """Return which of N segments (in cells) cross nothing but allowed cells."""
        # A segment changes cells where it meets a grid line; between two neighbouring meetings it stays in one cell,
        # that of the point halfway.
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
        allowed = self._is_among(np.floor(between).astype(np.intp), self.allowed)
        crossed: NDArray[np.bool_] = np.asarray(allowed.all(axis=1))
        return crossed

    def _is_among(self, cells: NDArray[np.intp], mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which cells (..., 2; column, row) are in a mask; none beyond the map is."""
        columns, rows = cells[..., 0], cells[..., 1]
        height, width = mask.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        among: NDArray[np.bool_] = inside & mask[rows.clip(0, height - 1), columns.clip(0, width - 1)]
        return among

    def _costs(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the costs at places (m), arrays of one shape; inf where it is forbidden."""
        grid = self.terrain.grid
        columns, rows = (x - grid.origin_x) / grid.resolution, (y - grid.origin_y) / grid.resolution
        height, width = self.allowed.shape
        within = [
            cells.min(initial=0.0) >= 0.0 and cells.max(initial=0.0) < size
            for cells, size in ((columns, width), (rows, height))
        ]
        if all(within):
            inside: FloatArray = self.priced[rows.astype(np.intp) * width + columns.astype(np.intp)]
            return inside
        on_map = (rows >= 0.0) & (rows < height) & (columns >= 0.0) & (columns < width)
        costs = np.full(on_map.shape, np.inf)
        costs[on_map] = self.priced[rows[on_map].astype(np.intp) * width + columns[on_map].astype(np.intp)]
        return costs
