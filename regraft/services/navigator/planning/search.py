"""Shortest ways over the cells of a terrain."""

import math
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
FARTHEST = 1e300
# A search ends first at so many times the straight distance, and so much (m) more. Few ways are longer.
USUAL_DETOUR, USUAL_EXTRA = 1.5, 2.0

# In the order of a row-major map, as a sorted sparse matrix has its columns.
STEPS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))


class CellGraph:
    """The allowed cells of a terrain, linked to their eight neighbours.

    A diagonal step is possible only where both cells next to it are allowed, so that no corner is cut.
    """

    def __init__(self, terrain: Terrain, allowed: NDArray[np.bool_], nodes: NDArray[np.bool_] | None = None) -> None:
        """Link the cells where `allowed` (rows, columns) holds; `changed` can link more of the `nodes`."""
        self.allowed = allowed
        self._terrain = terrain
        self._nodes = allowed if nodes is None else nodes
        self._network: _Network | None = None
        self._weights: FloatArray | None = None
        self._base: CellGraph | None = None
        self._root = NO_CELL
        self._limit = 0.0
        self._distances: FloatArray = np.empty(0)
        self._towards_root: NDArray[np.int32] = np.empty(0, np.int32)

    def changed(self, terrain: Terrain, allowed: NDArray[np.bool_]) -> Self:
        """Return the graph of a changed terrain of the same map; only the links of the changed cells are made."""
        if (allowed & ~self._nodes).any():
            return type(self)(terrain, allowed)
        graph = type(self)(terrain, allowed, self._nodes)
        graph._base = self
        return graph

    def way(self, start: tuple[int, int], goal: tuple[int, int]) -> NDArray[np.intp] | None:
        """Return the cells (N, 2; row, column) of the cheapest way, both ends included, or None.

        The search runs from the goal and is kept: the next way to the same goal costs next to nothing.
        """
        network, _ = self._links()
        first, last = int(network.number[start]), int(network.number[goal])
        if NO_CELL in (first, last):
            return None
        if last != self._root:
            resolution = self._terrain.grid.resolution
            self._search(last, USUAL_DETOUR * math.dist(start, goal) * resolution + USUAL_EXTRA)
        chain = self._chain(first)
        if chain is None and self._limit < FARTHEST:
            self._search(last, FARTHEST)
            chain = self._chain(first)
        if chain is None:
            return None
        return np.stack(np.divmod(network.cells[chain], self.allowed.shape[1]), axis=1)

    def _links(self) -> tuple["_Network", FloatArray]:
        """Return nodes and costs of links; made when first needed, as many maps never are."""
        if self._network is None or self._weights is None:
            base = self._base
            if base is None:
                self._network = _Network.of(self._nodes)
                self._weights = self._network.weights(self._terrain, self.allowed, self._network.cells)
            else:
                self._network, weights = base._links()
                differs = (self._terrain.cost != base._terrain.cost) | (self.allowed != base.allowed)
                cells = np.flatnonzero(_grown(differs) & self._nodes)
                self._weights = weights.copy()
                self._weights[self._network.number.ravel()[cells]] = self._network.weights(
                    self._terrain, self.allowed, cells
                )
            self._base = None
        return self._network, self._weights

    def _search(self, root: int, limit: float) -> None:
        """Find the cheapest ways to a node from all those that cost at most `limit` (m)."""
        network, weights = self._links()
        count = len(network.cells)
        matrix = csr_array((weights.ravel(), network.targets.ravel(), network.begins), shape=(count, count))
        self._distances, self._towards_root = dijkstra(matrix, indices=root, return_predecessors=True, limit=limit)
        self._root, self._limit = root, limit

    def _chain(self, first: int) -> NDArray[np.intp] | None:
        """Return the nodes from the first to the root, or None where the search has not come or was not decided."""
        nodes = [first]
        while nodes[-1] != self._root:
            following = int(self._towards_root[nodes[-1]])
            if following == NO_CELL:
                return None
            nodes.append(following)
        chain = np.array(nodes, np.intp)
        return chain if self._limit == FARTHEST or self._unique(chain) else None

    def _unique(self, chain: NDArray[np.intp]) -> bool:
        """Return whether every search takes this way, however far it goes.

        A cell follows the neighbour that was reached first of those that lead to the goal at the least cost. Which of
        two neighbours at the same distance that is depends on all that the search has seen.
        """
        network, weights = self._links()
        cells = chain[:-1]
        before = self._distances[network.targets[cells]]
        cheapest = before + weights[cells] == self._distances[cells, None]
        earliest = np.where(cheapest, before, np.inf)
        return bool(((earliest == earliest.min(axis=1, keepdims=True)).sum(axis=1) == 1).all())


class _Network:
    """Nodes and their links, each with eight places, of which some are not in use.

    `cells` are the nodes' places on the map, row by row; `number` (rows, columns) are the cells' nodes.
    """

    def __init__(self, cells: NDArray[np.intp], number: NDArray[np.int32], targets: NDArray[np.int32]) -> None:
        self.cells, self.number, self.targets = cells, number, targets
        self.begins = np.arange(0, 8 * len(cells) + 1, 8, dtype=np.int32)

    @classmethod
    def of(cls, nodes: NDArray[np.bool_]) -> Self:
        cells = np.flatnonzero(nodes)
        number = np.full(nodes.shape, NO_CELL, np.int32)
        number.ravel()[cells] = np.arange(len(cells), dtype=np.int32)
        around = np.pad(number, 1, constant_values=NO_CELL).ravel()
        here = _padded(cells, nodes.shape[1])
        width = nodes.shape[1] + 2
        targets = np.stack([around[here + row * width + column] for row, column in STEPS], axis=1)
        return cls(cells, number, np.where(targets == NO_CELL, number.ravel()[cells][:, None], targets))

    def weights(self, terrain: Terrain, allowed: NDArray[np.bool_], cells: NDArray[np.intp]) -> FloatArray:
        """Return what the steps (N, 8) from cells cost (m)."""
        width = allowed.shape[1] + 2
        here = _padded(cells, allowed.shape[1])
        passable, cost = np.pad(allowed, 1).ravel(), np.pad(terrain.cost, 1).ravel()
        may = {(row, column): passable[here + row * width + column] for row, column in (*STEPS, (0, 0))}
        cost_here = cost[here]
        result = np.empty((len(cells), len(STEPS)))
        for number, (row, column) in enumerate(STEPS):
            possible = may[0, 0] & may[row, column]
            length = terrain.grid.resolution
            if row and column:
                possible &= may[row, 0] & may[0, column]
                length *= math.sqrt(2)
            steps = length * (1.0 + (cost_here + cost[here + row * width + column]) / 2)
            result[:, number] = np.where(possible, steps, NO_LINK)
        return result


def _padded(cells: NDArray[np.intp], columns: int) -> NDArray[np.intp]:
    """Return the indices of cells in a map with one more cell at each side."""
    rows, columns_ = np.divmod(cells, columns)
    places: NDArray[np.intp] = (rows + 1) * (columns + 2) + columns_ + 1
    return places


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells of a mask and all their neighbours."""
    tall = mask.copy()
    tall[1:] |= mask[:-1]
    tall[:-1] |= mask[1:]
    grown = tall.copy()
    grown[:, 1:] |= tall[:, :-1]
    grown[:, :-1] |= tall[:, 1:]
    return grown
