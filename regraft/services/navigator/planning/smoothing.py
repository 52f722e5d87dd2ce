"""From a chain of cells to a path that a robot likes to drive."""

from itertools import pairwise

import numpy as np

from regraft.planar import FloatArray
from regraft.services.navigator.planning.terrain import Ground

LOOK_AHEAD = 40  # points: how long one straight stretch may become, 2 m at 0.05 m cells
SMOOTHINGS = 12


def shortcut(points: FloatArray, ground: Ground) -> FloatArray:
    """Replace stretches of a polyline (N, 2) by straight ones that are allowed and cost no more."""
    if len(points) < 3:
        return points
    along = np.concatenate([[0.0], np.cumsum(ground.step_costs(points))])
    kept = [0]
    while kept[-1] < len(points) - 1:
        here = kept[-1]
        ahead = np.arange(here + 1, min(len(points), here + 1 + LOOK_AHEAD))
        straight = ground.straight_costs(points[here], points[ahead])
        cheaper = ahead[straight <= (along[ahead] - along[here]) * 1.001]
        for candidate in cheaper[::-1]:
            if ground.crossable(points[[here, candidate]]).all():
                kept.append(int(candidate))
                break
        else:
            kept.append(here + 1)
    return points[kept]


def subdivide(points: FloatArray, spacing: float) -> FloatArray:
    """Put points on a polyline (N, 2) so that neighbours are at most `spacing` (m) apart."""
    pieces = [points[:1]]
    for start, end in pairwise(points):
        count = max(1, int(np.ceil(np.hypot(*(end - start)) / spacing - 1e-9)))
        pieces.append(start + np.arange(1, count)[:, None] / count * (end - start))
        pieces.append(end[None])
    return np.concatenate(pieces)


def smooth(points: FloatArray, ground: Ground) -> FloatArray:
    """Round the corners of a polyline (N, 2) where that stays on allowed ground; the ends stay."""
    for _ in range(SMOOTHINGS):
        rounded = points.copy()
        rounded[1:-1] = (points[:-2] + 2 * points[1:-1] + points[2:]) / 4
        blocked = np.flatnonzero(~ground.crossable(rounded))
        if len(blocked):
            rounded[blocked], rounded[blocked + 1] = points[blocked], points[blocked + 1]
            if not ground.crossable(rounded).all():
                break
        points = rounded
    return points
