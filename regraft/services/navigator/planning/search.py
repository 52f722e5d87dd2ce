"""Shortest ways over the cells of a terrain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array  # type: ignore[import-untyped, unused-ignore]
from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped, unused-ignore]

from regraft.planar import FloatArray
from regraft.services.navigator.planning.terrain import Terrain

NO_CELL = -9999  # csgraph's word for "no predecessor"
# csgraph passes a link over only if it leads beyond a finite limit.
NO_LINK = math.inf
EVERYWHERE = 1e300
# A narrow search looks for ways that cost this much (m) more than expected, then so many times that.
BEYOND_EXPECTED, FARTHER, NARROW_SEARCHES = 1.5, 1.6, 3
USUAL_DETOUR = 1.25  # times the straight distance is expected where nothing else is
ROUNDING = 1e-6  # m, far more than the sums of costs are off

# In the order of a row-major map, as a sorted sparse matrix has its columns.
STEPS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))
PASSED = {0: (1, 3), 2: (1, 4), 5: (3, 6), 7: (4, 6)}
"""The steps to the two cells that each diagonal step passes."""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """The `cells` (N, 2; row, column) of a way, both ends included, and what it costs (m)."""

    cells: NDArray[np.intp]
    cost: float


class _Network:
    """Nodes and their links, each with eight places, of which some are not in use.

    `cells` are the nodes' places on the map, row by row; `number` (rows, columns) are the cells' nodes.
    """

    def __init__(self, cells: NDArray[np.intp], number: NDArray[np.int32], targets: NDArray[np.int32]) -> None:
        self.cells, self.number, self.targets = cells, number, targets
        self._rows, self._columns = np.divmod(cells.astype(np.int32), np.int32(number.shape[1]))

    @classmethod
    def of(cls, nodes: NDArray[np.bool_]) -> Self:
        cells = np.flatnonzero(nodes)
        number = np.full(nodes.shape, NO_CELL, np.int32)
        number.ravel()[cells] = np.arange(len(cells), dtype=np.int32)
        around = np.pad(number, 1, constant_values=NO_CELL).ravel()
        width = nodes.shape[1] + 2
        rows, columns = np.divmod(cells, nodes.shape[1])
        here = (rows + 1) * width + columns + 1
        targets = np.stack([around[here + row * width + column] for row, column in STEPS], axis=1)
        return cls(cells, number, np.where(targets == NO_CELL, number.ravel()[cells][:, None], targets))

    def steps(self, node: int) -> FloatArray:
        """Return how far (cells) each node is from one, over open ground."""
        rows = np.abs(self._rows - self._rows[node])
        columns = np.abs(self._columns - self._columns[node])
        steps: FloatArray = np.maximum(rows, columns) + (math.sqrt(2) - 1.0) * np.minimum(rows, columns)
        return steps

    def costs(self, terrain: Terrain, allowed: NDArray[np.bool_], nodes: NDArray[np.intp]) -> FloatArray:
        """Return what the steps (N, 8) from nodes cost (m)."""
        targets, here = self.targets[nodes], self.cells[nodes]
        there = self.cells[targets]
        passable, cost = allowed.ravel(), terrain.cost.ravel()
        possible = passable[there] & passable[here, None] & (targets != nodes[:, None])
        for diagonal, beside in PASSED.items():
            possible[:, diagonal] &= possible[:, beside[0]] & possible[:, beside[1]]
        lengths = terrain.grid.resolution * np.array([math.sqrt(2) if row and column else 1.0 for row, column in STEPS])
        steps = lengths * (1.0 + (cost[here, None] + cost[there]) / 2)
        return np.where(possible, steps, NO_LINK)


class CellGraph:
    """The allowed cells of a terrain, linked to their eight neighbours.

    A diagonal step is possible only where both cells next to it are allowed, so that no corner is cut.
    """

    def __init__(self, terrain: Terrain, allowed: NDArray[np.bool_], nodes: NDArray[np.bool_] | None = None) -> None:
        """Link the cells where `allowed` (rows, columns) holds; graphs made by `changed` may link more `nodes`."""
        self._terrain, self._allowed = terrain, allowed
        self._nodes = allowed if nodes is None else nodes
        self._base: CellGraph | None = None
        self._made: tuple[_Network, FloatArray] | None = None
        self._root = NO_CELL
        self._found = _Search(np.empty(0), np.empty(0, np.int32))

    def changed(self, terrain: Terrain, allowed: NDArray[np.bool_]) -> CellGraph:
        """Return the graph of a changed terrain of the same map; only the links of the changed cells are made."""
        if (allowed & ~self._nodes).any():
            return CellGraph(terrain, allowed)
        graph = CellGraph(terrain, allowed, self._nodes)
        graph._base = self._base or self
        return graph

    def way(self, start: tuple[int, int], goal: tuple[int, int], expected: float | None = None) -> Way | None:
        """Return the cheapest way between two cells (row, column), or None.

        The search runs from the goal. In a changed graph, it first sees only what a way of about the `expected` cost
        (m) needs. Else it is kept: the next way to the same goal costs next to nothing. Both find the
        same way.
        """
        network, _ = self._links
        first, last = int(network.number[start]), int(network.number[goal])
        if NO_CELL in (first, last):
            return None
        if self._base is not None and self._root != last:
            straight = math.dist(start, goal) * self._terrain.grid.resolution
            limit = (USUAL_DETOUR * straight if expected is None else expected) + BEYOND_EXPECTED
            for search in range(NARROW_SEARCHES):
                came, way = self._narrow(first, last, limit * FARTHER**search)
                if way is not None:
                    return way
                if came:
                    break
        if self._root != last:
            self._found = _search(network.targets, self._costs(np.arange(len(network.cells))), last, EVERYWHERE)
            self._root = last
        chain = self._found.chain(first, last)
        return None if chain is None else self._way(chain, float(self._found.distances[first]))

    @property
    def _links(self) -> tuple[_Network, FloatArray]:
        """Return nodes, and costs of the links of an unchanged graph; made when first needed, as many never are."""
        if self._base is not None:
            return self._base._links
        if self._made is None:
            network = _Network.of(self._nodes)
            nodes = np.arange(len(network.cells))
            self._made = network, network.costs(self._terrain, self._allowed, nodes)
        return self._made

    def _costs(self, nodes: NDArray[np.intp]) -> FloatArray:
        """Return what the steps (N, 8) from nodes cost (m)."""
        network, made = self._links
        base, costs = self._base, made[nodes]
        if base is not None:
            differs = (self._terrain.cost != base._terrain.cost) | (self._allowed != base._allowed)
            changed = np.flatnonzero(_grown(differs).ravel()[network.cells[nodes]])
            costs[changed] = network.costs(self._terrain, self._allowed, nodes[changed])
        return costs

    def _narrow(self, first: int, last: int, limit: float) -> tuple[bool, Way | None]:
        """Return whether a way costs at most `limit` (m), and the cheapest one.

        There is none where it is not certain that a search everywhere would find the same one. A way that costs no more
        visits no cell that is farther from both ends together. So such cells are left out.
        """
        network, _ = self._links
        resolution = self._terrain.grid.resolution
        detours = (network.steps(first) + network.steps(last)) * resolution
        nodes = np.flatnonzero(detours <= limit + ROUNDING)
        number = np.full(len(network.cells), NO_CELL, np.int32)
        number[nodes] = np.arange(len(nodes), dtype=np.int32)
        if NO_CELL in (number[first], number[last]):
            return False, None
        targets, costs = number[network.targets[nodes]], self._costs(nodes)
        outside = targets == NO_CELL
        targets[outside], costs[outside] = 0, NO_LINK
        found = _search(targets, costs, int(number[last]), limit)
        chain = found.chain(int(number[first]), int(number[last]))
        if chain is None or not found.only(chain, targets, costs):
            return chain is not None, None
        return True, self._way(nodes[chain], float(found.distances[number[first]]))

    def _way(self, chain: NDArray[np.intp], cost: float) -> Way:
        cells = self._links[0].cells[chain]
        return Way(np.stack(np.divmod(cells, self._allowed.shape[1]), axis=1), cost)


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """The result of a search: the nodes' `distances` (m) from its root, and which node `follows` on the way to it."""

    distances: FloatArray
    follows: NDArray[np.int32]

    def chain(self, first: int, root: int) -> NDArray[np.intp] | None:
        """Return the nodes from the first to the root, or None where the search has not come."""
        nodes = [first]
        while nodes[-1] != root:
            following = int(self.follows[nodes[-1]])
            if following == NO_CELL:
                return None
            nodes.append(following)
        return np.array(nodes, np.intp)

    def only(self, chain: NDArray[np.intp], targets: NDArray[np.int32], costs: FloatArray) -> bool:
        """Return whether every search would find this chain, regardless of what else it sees.

        A node follows the neighbour that was reached first of those that lead to the root at the least cost. Which of
        two neighbours at the same distance that is depends on all that the search has seen.
        """
        nodes = chain[:-1]
        before = self.distances[targets[nodes]]
        cheapest = before + costs[nodes] == self.distances[nodes, None]
        earliest = np.where(cheapest, before, np.inf)
        return bool(((earliest == earliest.min(axis=1, keepdims=True)).sum(axis=1) == 1).all())


def _search(targets: NDArray[np.int32], costs: FloatArray, root: int, limit: float) -> _Search:
    """Find the cheapest ways to a node from all those that cost at most `limit` (m); (N, 8) are links and costs."""
    begins = np.arange(0, targets.size + 1, targets.shape[1], dtype=np.int32)
    matrix = csr_array((costs.ravel(), targets.ravel(), begins), shape=(len(targets), len(targets)))
    return _Search(*dijkstra(matrix, indices=root, return_predecessors=True, limit=limit))


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells of a mask and all their neighbours."""
    tall = mask.copy()
    tall[1:] |= mask[:-1]
    tall[:-1] |= mask[1:]
    grown = tall.copy()
    grown[:, 1:] |= tall[:, :-1]
    grown[:, :-1] |= tall[:, 1:]
    return grown
