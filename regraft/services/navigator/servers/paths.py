"""From polylines to paths of poses, and back."""

from __future__ import annotations

import numpy as np

from regraft.bus_schema.messages.nav2.paths import Path
from regraft.planar import FloatArray
from regraft.services.navigator.polyline import lengths_along

MAP_FRAME = "map"


def path_of(stamp: float, points: FloatArray, yaw: float) -> Path:
    """Return the path through points (N, 2): each pose looks at the next one, the last along ``yaw`` (rad)."""
    return Path.of(stamp, MAP_FRAME, np.column_stack([points, headings(points, yaw)]))


def headings(points: FloatArray, yaw: float) -> FloatArray:
    """Return the heading (N,) at each of N points: that of the way to the next one, and ``yaw`` (rad) at the last."""
    found = np.full(len(points), yaw)
    if len(points) > 1:
        ways = np.diff(points, axis=0)
        found[:-1] = np.arctan2(ways[:, 1], ways[:, 0])
    return found


def joined(stamp: float, legs: list[Path]) -> Path:
    """Return the path along several, of which each begins where the one before ends."""
    poses = [pose for number, leg in enumerate(legs) for pose in leg.poses[min(number, 1) :]]
    return Path(stamp, MAP_FRAME, tuple(poses))


def nearest_index(points: FloatArray, place: tuple[float, float]) -> int:
    """Return the index of that of some points (N, 2) that is nearest to a place (m)."""
    offsets = points - place
    return int(np.einsum("ij,ij->i", offsets, offsets).argmin())


def ahead_of(points: FloatArray, place: tuple[float, float], distance: float) -> tuple[int, int]:
    """Return from which index to which (excluded) points (N, 2) lie from ``place`` on, up to ``distance`` (m) along.

    A negative distance is all the way.
    """
    first = nearest_index(points, place)
    if distance < 0.0:
        return first, len(points)
    along = lengths_along(points)
    return first, int(np.searchsorted(along, along[first] + distance, side="right"))
