"""A scan's information on the ground: free along the beams, occupied at their ends."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from regraft.planar import Pose2D
from regraft.services.mapper.maps.grid import ENOUGH, FINE, SUREST, UNKNOWN, Grid, Window
from regraft.services.mapper.maps.scan import Scan

HIT = 17
"""Steps that an echo adds to its cell: odds of 70 % against 30 %."""
MISS = 8
"""Steps that a beam takes from a cell that it crosses: 40 % against 60 %."""
NO_ECHO = 2
"""Steps that a beam without echo takes: it may as well have been swallowed as have gone through."""
STEP = 1.0
"""Distance between the places that are looked at along a beam, as a share of a cell."""
SHORT_OF_END = 1.0
"""Cells before an echo that are not called free: a beam that grazes a wall runs through its cells."""


def insert(grid: Grid, pose: Pose2D, scan: Scan) -> bool:
    """Write a scan, taken with the robot's base at ``pose`` (map frame), into the grid.

    Every cell changes once: occupied if any beam ends in it, else free if any crosses it. Returns False if part of
    the scan lies beyond the largest grid; that part is left out.
    """
    sensor = pose.compose(scan.sensor)
    echoed = scan.echoed
    lengths = np.where(echoed, scan.ranges, scan.range_max).astype(np.float32)
    ends = sensor.outward(lengths[:, None] * scan.beams)
    low, high = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
    fits = grid.cover(
        (low[0] - grid.resolution, low[1] - grid.resolution), (high[0] + grid.resolution, high[1] + grid.resolution)
    )
    window = grid.window(sensor.x, sensor.y, float(lengths.max()) + grid.resolution)
    if window.cells.size:
        _update(window, sensor, scan, echoed, lengths)
    return fits


def _update(
    window: Window, sensor: Pose2D, scan: Scan, echoed: NDArray[np.bool_], lengths: NDArray[np.float32]
) -> None:
    directions = _in_cells(window, sensor, scan)
    short = lengths - np.float32(SHORT_OF_END * window.resolution)
    change = np.zeros(window.cells.size, np.int16)
    silent = scan.silent
    if silent.any():
        crossed = _crossed(window, sensor, directions[:, silent], short[silent])
        if np.count_nonzero(~echoed) > len(silent) / 2:
            # A lidar that fails is silent all around: that is no sign that an obstacle has gone.
            crossed = crossed[window.cells.ravel()[crossed] <= UNKNOWN]
        change[crossed] = -NO_ECHO
    change[_crossed(window, sensor, directions[:, echoed], short[echoed])] = -MISS
    ends = _from(window, sensor, lengths[echoed] * directions[:, echoed])
    change[_cells(window, *ends)] = HIT
    rows, columns = np.divmod(np.flatnonzero(change), window.cells.shape[1])
    now = np.clip(window.cells[rows, columns] + change[change != 0], -SUREST, SUREST)
    now[now == UNKNOWN] = -1
    window.cells[rows, columns] = now
    _note_echoes(window, *ends)
    freed = now < UNKNOWN
    window.echoes[rows[freed], columns[freed]] = 0


def _note_echoes(window: Window, x: NDArray[np.float32], y: NDArray[np.float32]) -> None:
    """Add echoes (columns and rows of the window, not rounded) to the means of their cells."""
    column, row = np.floor(x), np.floor(y)
    within = np.stack([x - column, y - row, np.ones_like(x)], axis=1) * np.array([FINE, FINE, 1], np.float32)
    columns, rows = column.astype(np.intp), row.astype(np.intp)
    kept = (columns >= 0) & (columns < window.cells.shape[1]) & (rows >= 0) & (rows < window.cells.shape[0])
    rows, columns, within = rows[kept], columns[kept], within[kept]
    open_ = window.echoes[rows, columns, 2] < ENOUGH
    np.add.at(window.echoes, (rows[open_], columns[open_]), within[open_].astype(np.uint16))


def _in_cells(window: Window, sensor: Pose2D, scan: Scan) -> NDArray[np.float32]:
    """Return the beams' directions (2, n) in the map frame, in cells per metre."""
    cos, sin = math.cos(sensor.yaw) / window.resolution, math.sin(sensor.yaw) / window.resolution
    x, y = scan.beams[:, 0], scan.beams[:, 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y]).astype(np.float32)


def _from(window: Window, sensor: Pose2D, ways: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where ways (2, ...; cells) from the sensor lead, as columns and rows of the window, not rounded."""
    first_x = np.float32((sensor.x - window.x) / window.resolution)
    first_y = np.float32((sensor.y - window.y) / window.resolution)
    return ways[0] + first_x, ways[1] + first_y


def _crossed(
    window: Window, sensor: Pose2D, directions: NDArray[np.float32], lengths: NDArray[np.float32]
) -> NDArray[np.intp]:
    """Return the cells, as indices into the flat window, that beams (2, n) cross within their lengths (n; m)."""
    if not len(lengths):
        return np.empty(0, np.intp)
    step = STEP * window.resolution
    counts = np.maximum(np.ceil(lengths / step), 0.0).astype(np.intp)
    beam = np.repeat(np.arange(len(lengths)), counts)
    # The places of one beam after the other: how far along its own beam each one is.
    number = np.arange(len(beam)) - np.repeat(np.cumsum(counts) - counts, counts)
    distance = number.astype(np.float32) * np.float32(step)
    return _cells(window, *_from(window, sensor, directions[:, beam] * distance))


def _cells(window: Window, x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.intp]:
    """Return the flat indices of the cells at columns and rows that are not rounded; those outside are left out."""
    rows, columns = window.cells.shape
    column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    if not inside.all():
        column, row = column[inside], row[inside]
    return np.asarray(row * columns + column, np.intp)
