"""Shortest ways over the cells of a terrain."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array  # type: ignore[import-untyped, unused-ignore]
from scipy.sparse.csgraph import (  # type: ignore[import-untyped, unused-ignore]
    connected_components,
    dijkstra,
)

from regraft.services.navigator.planning.terrain import Terrain

NO_CELL = -9999  # csgraph's word for "no predecessor"


class CellGraph:
    """The allowed cells of a terrain, linked to their eight neighbours.

    A diagonal step is possible only where both cells next to it are allowed, so that no corner is cut.
    """

    def __init__(self, terrain: Terrain, allowed: NDArray[np.bool_]) -> None:
        """Link the cells where `allowed` (rows, columns) holds."""
        self._columns = allowed.shape[1]
        self._terrain, self._allowed = terrain, allowed
        self._links: csr_array | None = None
        self._root = NO_CELL
        self._towards_root: NDArray[np.int32] = np.empty(0, np.int32)

    @property
    def _matrix(self) -> csr_array:
        """Return the cost of each step between neighbouring cells; made when first needed, as many maps never are."""
        if self._links is None:
            self._links = _links(self._terrain, self._allowed)
        return self._links

    def regions(self) -> NDArray[np.int32]:
        """Number the connected regions: cells (rows, columns) with equal numbers can reach each other."""
        _, labels = connected_components(self._matrix, directed=False)
        return np.asarray(labels, np.int32).reshape(-1, self._columns)

    def way(self, start: tuple[int, int], goal: tuple[int, int]) -> NDArray[np.intp] | None:
        """Return the cells (N, 2; row, column) of the cheapest way, both ends included, or None.

        The search runs from the goal and is kept: the next way to the same goal costs next to nothing.
        """
        first, last = start[0] * self._columns + start[1], goal[0] * self._columns + goal[1]
        if last != self._root:
            _, before = dijkstra(self._matrix, indices=last, return_predecessors=True)
            self._root, self._towards_root = last, before
        cells = [first]
        while cells[-1] != last:
            following = int(self._towards_root[cells[-1]])
            if following == NO_CELL:
                return None
            cells.append(following)
        return np.stack(np.divmod(np.array(cells, np.intp), self._columns), axis=1)


def _links(terrain: Terrain, allowed: NDArray[np.bool_]) -> csr_array:
    """Return the matrix of what each step between neighbouring cells costs (m), both ways."""
    rows, columns = allowed.shape
    number = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    cost = terrain.cost
    left, right = slice(None, -1), slice(1, None)
    steps = [  # (from, to, the cells that a diagonal passes)
        ((slice(None), left), (slice(None), right), []),
        ((left, slice(None)), (right, slice(None)), []),
        ((left, left), (right, right), [(left, right), (right, left)]),
        ((left, right), (right, left), [(left, left), (right, right)]),
    ]
    sources, targets, weights = [], [], []
    for here, there, beside in steps:
        possible = allowed[here] & allowed[there]
        for passed in beside:
            possible &= allowed[passed]
        length = terrain.grid.resolution * (math.sqrt(2) if beside else 1.0)
        sources.append(number[here][possible])
        targets.append(number[there][possible])
        weights.append(length * (1.0 + (cost[here][possible] + cost[there][possible]) / 2))
    source, target, weight = np.concatenate(sources), np.concatenate(targets), np.concatenate(weights)
    both = (np.concatenate([source, target]), np.concatenate([target, source]))
    return csr_array((np.concatenate([weight, weight]), both), shape=(number.size, number.size))
