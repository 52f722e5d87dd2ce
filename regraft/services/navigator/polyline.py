"""Measuring along polylines: paths as rows of points."""

import numpy as np

from regraft.planar import FloatArray, Pose2D


def stretch_ahead(path: FloatArray, pose: Pose2D, length: float) -> FloatArray:
    """Return the part of a path (N, 2) from the robot on, at least `length` (m) long where possible."""
    if len(path) < 2:
        return path
    # By columns: NumPy is slow along rows of two.
    x, y = path[:, 0], path[:, 1]
    ways_x, ways_y = x[1:] - x[:-1], y[1:] - y[:-1]
    offsets_x, offsets_y = x[:-1] - pose.x, y[:-1] - pose.y
    squares = np.maximum(ways_x * ways_x + ways_y * ways_y, 1e-12)
    fractions = np.minimum(np.maximum(-(offsets_x * ways_x + offsets_y * ways_y) / squares, 0.0), 1.0)
    offsets_x += fractions * ways_x
    offsets_y += fractions * ways_y
    nearest = int((offsets_x * offsets_x + offsets_y * offsets_y).argmin())
    foot = path[nearest] + fractions[nearest] * (path[nearest + 1] - path[nearest])
    rest = np.concatenate([foot[None], path[nearest + 1 :]])
    return rest[: int(np.searchsorted(lengths_along(rest), length)) + 1]


def points_along(points: FloatArray, distances: FloatArray, along: FloatArray | None = None) -> FloatArray:
    """Return the points (K, 2) at `distances` (K,) in m along a polyline (N, 2), its end beyond the end.

    `along` (N,) are its `lengths_along`, where they are known.
    """
    if along is None:
        along = lengths_along(points)
    found = np.empty((len(distances), 2))
    found[:, 0] = np.interp(distances, along, points[:, 0])
    found[:, 1] = np.interp(distances, along, points[:, 1])
    return found


def lengths_along(points: FloatArray) -> FloatArray:
    """Return how far (m) along a polyline (N, 2) each of its points lies, (N,)."""
    along = np.zeros(len(points))
    steps = points[1:] - points[:-1]
    np.cumsum(np.sqrt(np.einsum("ij,ij->i", steps, steps)), out=along[1:])
    return along


def polyline_length(points: FloatArray) -> float:
    """Return the length (m) of the polyline through (N, 2) points."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) > 1 else 0.0
