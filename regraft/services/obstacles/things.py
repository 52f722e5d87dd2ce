"""The things in a room: everything that known ground surrounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes, find_objects, label  # type: ignore[import-untyped, unused-ignore]

from regraft.planar import Point
from regraft.services.explorer.ground import EIGHT, Ground, Mask

Rows = NDArray[np.intp]
FEWEST = 3
"""Occupied cells; fewer are a speck."""


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """Something that stands alone: the middle of what was seen of it (m), and its cells (rows, columns)."""

    centre: Point
    cells: Mask


def find_things(ground: Ground, smallest: float, largest: float) -> list[Thing]:
    """Return what stands in the room, in the order of the map's rows.

    Walls are what is connected to the outside of the room, over cells not known to be free. So pieces of a wall are
    walls too, and a thing is found once it is seen from all around. `smallest` and `largest` (m) bound the diagonal of
    a thing: smaller ones are noise, larger ones walls.
    """
    open_ground = ground.free & ~ground.walls
    regions, _ = label(open_ground)
    inside = np.isin(regions, np.unique(regions[ground.reachable & open_ground])) & (regions > 0)
    # The rim of what is not known keeps a room that fills its map from having no outside.
    surrounded = binary_fill_holes(np.pad(inside, 1))[1:-1, 1:-1] & ~inside
    blobs, _ = label(surrounded, EIGHT)
    things = []
    for number, box in enumerate(find_objects(blobs), 1):
        blob = blobs[box] == number
        rows, columns = np.nonzero(blob & ground.grid.occupied[box])
        if len(rows) < FEWEST:
            continue
        # The unknown inside of a thing is a part of it, but its shadow would draw its middle away.
        size = np.hypot(np.ptp(rows) + 1, np.ptp(columns) + 1) * ground.grid.resolution
        if smallest <= size <= largest:
            things.append(_thing(ground, box, blob, rows, columns))
    return things


def _thing(ground: Ground, box: tuple[slice, slice], blob: Mask, rows: Rows, columns: Rows) -> Thing:
    grid = ground.grid
    row = box[0].start + (float(rows.min()) + float(rows.max())) / 2 + 0.5
    column = box[1].start + (float(columns.min()) + float(columns.max())) / 2 + 0.5
    cells = np.zeros(grid.cells.shape, bool)
    cells[box] = blob
    return Thing((grid.origin_x + column * grid.resolution, grid.origin_y + row * grid.resolution), cells)
