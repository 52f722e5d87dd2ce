"""Global planning: short, collision-free paths over an occupancy grid.

The shortest way over its cells is found by scipy's `csgraph.dijkstra`, from the goal, then straightened and rounded.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label  # type: ignore[import-untyped, unused-ignore]

from regraft.planar import FloatArray, Point
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.planning.search import CellGraph
from regraft.services.navigator.planning.smoothing import shortcut, smooth, subdivide
from regraft.services.navigator.planning.terrain import Ground, Inflation, Terrain

# N x 2 points (m) in the map's frame, from start to goal, at most SPACING apart.
Path = FloatArray
SPACING = 0.05

NO_POINTS: FloatArray = np.empty((0, 2))


class NoPath(Exception):
    """There is no path from `start` to `goal`; `reason` states why."""

    def __init__(self, start: Point, goal: Point, reason: str) -> None:
        """Keep the ends (m) and the reason for programs; the message states them all."""
        super().__init__(f"no path from ({start[0]:.3f}, {start[1]:.3f}) to ({goal[0]:.3f}, {goal[1]:.3f}): {reason}")
        self.start, self.goal, self.reason = start, goal, reason


@dataclass(frozen=True, slots=True, eq=False)
class _Layer:
    """The map with obstacles added in `cells`, which are counted row by row; ways normally run where it is `free`."""

    cells: NDArray[np.intp]
    terrain: Terrain
    free: NDArray[np.bool_]
    graph: CellGraph


class GridPlanner:
    """Plans on one map. Building it does what depends on the map alone; a changed map needs a new one.

    Paths keep `inflation.lethal` (m) from obstacles, except close to a start or a goal that lies nearer. They keep
    further away where that costs little. `cross_unknown` allows ways through unknown cells.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        inflation: Inflation | None = None,
        cross_unknown: bool = True,
    ) -> None:
        """Inflate the map's obstacles; all else is done when it is first asked for."""
        self.grid = grid
        self._inflation = inflation or Inflation()
        terrain = Terrain.of(grid, self._inflation, cross_unknown)
        free = terrain.free_explored
        # Ways into and out of tight corners may use all that is open.
        graph = CellGraph(terrain, free, terrain.explored_part(terrain.open))
        self._static = self._seen = _Layer(np.empty(0, np.intp), terrain, free, graph)
        self._labels: NDArray[np.int32] | None = None
        self._last: tuple[Point, Point, _Layer, Path] | None = None
        # The goal's cell and the cost (m) of the last way: the next one there is hardly any longer.
        self._cost: tuple[tuple[int, int], float] | None = None

    def clearance(self, points: FloatArray) -> FloatArray:
        """Return how far (m) the map's nearest obstacle is from (N, 2) points; inf beyond the map."""
        rows, columns = self.grid.cells_of(points)
        shape = self.grid.cells.shape
        inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
        known = self._static.terrain.clearance[rows.clip(0, shape[0] - 1), columns.clip(0, shape[1] - 1)]
        result: FloatArray = np.where(inside, known, np.inf)
        return result

    def roomy(self, point: Point) -> bool:
        """Return whether the map leaves the robot room to turn at a point (m)."""
        return bool(self.clearance(np.array([point]))[0] >= self._inflation.turning)

    def leave_obstacle(self, point: Point, reach: float, obstacles: FloatArray = NO_POINTS) -> Point:
        """Return the point itself, or the nearest one within `reach` (m) where no obstacle is, if it is in one.

        A robot that stands in an obstacle shows that the map is a little off.
        """
        terrain = self._with(obstacles).terrain
        if not self.grid.contains(point) or terrain.open[self.grid.cell_of(point)]:
            return point
        rows, columns = np.nonzero(terrain.around(self.grid.cell_of(point), reach))
        if not len(rows):
            return point
        centres = self.grid.centres(rows, columns)
        nearest = int(np.hypot(centres[:, 0] - point[0], centres[:, 1] - point[1]).argmin())
        return (float(centres[nearest, 0]), float(centres[nearest, 1]))

    def plan(self, start: Point, goal: Point, obstacles: FloatArray = NO_POINTS) -> Path:
        """Return a path from `start` to `goal` (m) that also avoids the points `obstacles` (N, 2).

        The path begins and ends exactly at the two points. Raises NoPath.
        """
        self._check(start, goal)
        layer = self._with(obstacles)
        if self._last is None or self._last[:3] != (start, goal, layer):
            self._last = (start, goal, layer, self._found(start, goal, layer))
        return self._last[3].copy()

    def terrain(self, obstacles: FloatArray = NO_POINTS) -> Terrain:
        """Return the map with the points `obstacles` (N, 2) added, as plans see it."""
        return self._with(obstacles).terrain

    def cost(self, path: Path, obstacles: FloatArray = NO_POINTS) -> float:
        """Return the length (m) of a path plus what its closeness to obstacles costs; inf across one."""
        terrain = self._with(obstacles).terrain
        return Ground(terrain, terrain.open).cost(path)

    def approach(self, start: Point, goal: Point, tolerance: float) -> Point:
        """Return where to drive for `goal`: the goal itself if the robot can turn there.

        Otherwise the nearest point within `tolerance` (m) that can be reached from `start` and leaves room to turn.
        Otherwise one that can at least be reached; the goal again if there is none. Goals taken from a map of objects
        often lie inside the object (NavFn's planner has the same tolerance). Raises NoPath.
        """
        self._check(start, goal)
        terrain, cell = self._static.terrain, self.grid.cell_of(goal)
        if terrain.free[cell] and terrain.clearance[cell] >= self._inflation.turning:
            return goal
        from_here = self._around(terrain, self.grid.cell_of(start)) & terrain.free
        window = terrain.window(cell, tolerance)
        regions, free = self._regions, terrain.free[window]
        near = np.isin(regions[window], regions[from_here]) & free & (self._distances(goal, window) <= tolerance)
        roomy = near & (terrain.clearance[window] >= self._inflation.turning)
        if terrain.free[cell] and not roomy.any():
            return goal
        rows, columns = np.nonzero(roomy if roomy.any() else near)
        if not len(rows):
            return goal
        rows, columns = rows + window[0].start, columns + window[1].start
        centres = self.grid.centres(rows, columns)
        nearest = np.argmin(np.hypot(centres[:, 0] - goal[0], centres[:, 1] - goal[1]))
        return (float(centres[nearest, 0]), float(centres[nearest, 1]))

    def _found(self, start: Point, goal: Point, layer: _Layer) -> Path:
        grid, terrain = self.grid, layer.terrain
        first, last = grid.cell_of(start), grid.cell_of(goal)
        for name, cell in (("start", first), ("goal", last)):
            if not terrain.open[cell]:
                where = "on unknown ground" if grid.cells[cell] < 0 else "inside an obstacle"
                raise NoPath(start, goal, f"the {name} is {where}")
        allowed = self._allowed(layer, first, last)
        graph = layer.graph if allowed is layer.free else layer.graph.changed(terrain, allowed)
        way = graph.way(first, last, self._cost[1] if self._cost and self._cost[0] == last else None)
        if way is None and allowed is layer.free and not np.array_equal(allowed, terrain.free):
            way = CellGraph(terrain, terrain.free).way(first, last)  # through the unknown beyond, if need be
            allowed = terrain.free
        if way is None:
            whose = "of the map and those seen" if layer is not self._static else "of the map"
            width = 2 * self._inflation.lethal
            raise NoPath(start, goal, f"the obstacles {whose} leave no way that is {width:.2f} m wide")
        self._cost = (last, way.cost)
        ground = Ground(terrain, allowed)
        points = grid.centres(way.cells[:, 0], way.cells[:, 1])
        points = np.concatenate([[start], points[1:-1], [goal]])
        return smooth(subdivide(shortcut(points, ground), SPACING), ground)

    @property
    def _regions(self) -> NDArray[np.int32]:
        """Return the numbers of connected regions, (rows, columns): cells with equal numbers can reach each other.

        A diagonal step leads past two free cells, so four neighbours of each cell are enough.
        """
        if self._labels is None:
            self._labels = np.asarray(label(self._static.terrain.free)[0], np.int32)
        return self._labels

    def _with(self, obstacles: FloatArray) -> _Layer:
        """Return the map with the obstacles (N, 2), the last one again if they have not changed."""
        extra = self.grid.on_map(obstacles)
        if not len(extra):
            return self._static
        rows, columns = self.grid.cells_of(extra)
        cells = np.unique(rows * self.grid.cells.shape[1] + columns)
        if not np.array_equal(self._seen.cells, cells):
            terrain = self._static.terrain.with_obstacles(cells)
            free = terrain.free_explored
            self._seen = _Layer(cells, terrain, free, self._static.graph.changed(terrain, free))
        return self._seen

    def _check(self, start: Point, goal: Point) -> None:
        for name, point in (("start", start), ("goal", goal)):
            if not (np.isfinite(point).all() and self.grid.contains(point)):
                reason = f"the {name} is outside the map, which spans {self.grid.extent()}"
                raise NoPath(start, goal, reason)

    def _allowed(self, layer: _Layer, first: tuple[int, int], last: tuple[int, int]) -> NDArray[np.bool_]:
        """Return the cells that a path may use: the free ones, and those around confined ends."""
        terrain = layer.terrain
        allowed = layer.free
        if not (terrain.is_explored(first) and terrain.is_explored(last)):
            allowed = terrain.free
        for cell in (first, last):
            if not terrain.free[cell]:
                allowed = allowed | self._around(terrain, cell)
        return allowed

    def _around(self, terrain: Terrain, cell: tuple[int, int]) -> NDArray[np.bool_]:
        """Return where a robot may move to leave a confined cell: the cell itself if it is free."""
        radius = 0.0 if terrain.free[cell] else self._inflation.lethal + 2 * self.grid.resolution
        return terrain.around(cell, radius)

    def _distances(self, point: Point, window: tuple[slice, slice]) -> FloatArray:
        """Return how far (m) the cells' centres in a part of the map are from a point."""
        rows, columns = np.ogrid[window]
        x = self.grid.origin_x + (columns + 0.5) * self.grid.resolution - point[0]
        y = self.grid.origin_y + (rows + 0.5) * self.grid.resolution - point[1]
        distances: FloatArray = np.hypot(x, y)
        return distances
