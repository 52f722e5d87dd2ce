"""Where to stand to look at a thing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray, Pose2D
from regraft.services import robot_parameters as usual
from regraft.services.explorer.ground import Ground, Mask
from regraft.services.obstacles.things import Thing

BEARINGS = 72
STEPS = (0.0, 0.05, -0.05, 0.10, -0.10, 0.20, 0.30)
"""How much farther (m) than liked from a thing's outline a pose may be, best first."""
ENOUGH_ROOM = 0.5
"""More room (m) than this around a pose is no better."""
BESIDE = 0.10
"""m to the left and right of a thing's middle that must be in sight as well."""
SPARE = 0.05
"""m of room that a goal may lose on a later map before another is looked for."""
NARROW = 0.10
"""m: a thing that has moved less on the map has not moved."""


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """How far (m) from a thing's outline to look at it, and how far from everything to stand."""

    standoff: float = 0.65
    room: float = usual.TURNING_ROOM


def find_view(ground: Ground, thing: Thing, settings: ViewSettings) -> Pose2D | None:
    """Return the best pose to look at a thing, facing its middle; None if there is none.

    The robot can stand there, get there, and sees the thing with nothing in between. Of several poses the one with most
    room is taken. Half of its deviation from the liked distance is subtracted.
    """
    bearings = np.arange(BEARINGS) * math.tau / BEARINGS
    directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
    outline = _outline(ground, thing, directions)
    away = (outline[:, None] + settings.standoff + np.array(STEPS)).ravel()
    places = np.array(thing.centre) + np.repeat(directions, len(STEPS), axis=0) * away[:, None]
    room = _room(ground, places)
    good = room >= settings.room
    good[good] = _in_sight(ground, thing, places[good])
    if not good.any():
        return None
    worth = np.minimum(room, ENOUGH_ROOM) - 0.5 * np.tile(np.abs(STEPS), BEARINGS)
    best = int(np.argmax(np.where(good, worth.round(6), -math.inf)))
    x, y = places[best].tolist()
    return facing(thing, x, y)


def still_good(ground: Ground, thing: Thing, pose: Pose2D, settings: ViewSettings) -> bool:
    """Return whether a pose that was found on an earlier map still shows the thing on this one."""
    place = np.array([pose.position])
    ahead = math.atan2(thing.centre[1] - pose.y, thing.centre[0] - pose.x)
    turned = abs(math.remainder(ahead - pose.yaw, math.tau)) * math.dist(thing.centre, pose.position)
    return turned < NARROW and bool(
        _room(ground, place)[0] >= settings.room - SPARE and _in_sight(ground, thing, place)[0]
    )


def facing(thing: Thing, x: float, y: float) -> Pose2D:
    """Return the pose at a place (m) that faces a thing's middle."""
    return Pose2D(x, y, math.atan2(thing.centre[1] - y, thing.centre[0] - x))


def _outline(ground: Ground, thing: Thing, directions: FloatArray) -> FloatArray:
    """Return how far (m) a thing reaches from its middle in each direction (N, 2)."""
    rows, columns = np.nonzero(thing.cells)
    reach = math.hypot(float(np.ptp(rows)) + 1, float(np.ptp(columns)) + 1) * ground.grid.resolution
    distances = np.arange(0.0, reach, ground.grid.resolution / 2)
    points = np.array(thing.centre) + directions[:, None, :] * distances[:, None]
    inside = _lookup(ground, thing.cells, points)
    farthest: FloatArray = (inside * distances).max(axis=1)
    return farthest


def _room(ground: Ground, places: FloatArray) -> FloatArray:
    """Return how far (m) from everything the robot is at places (N, 2); 0 where it cannot get to."""
    there = _lookup(ground, ground.reachable, places)
    rows, columns = _cells(ground, places)
    room: FloatArray = np.where(there, ground.room[rows, columns], 0.0)
    return room


def _in_sight(ground: Ground, thing: Thing, places: FloatArray) -> Mask:
    """Return which places (N, 2) see a thing's middle, and what is close next to it, past everything else."""
    ways = np.array(thing.centre) - places
    left = np.column_stack([-ways[:, 1], ways[:, 0]]) / np.hypot(*ways.T)[:, None]
    opaque = (ground.walls | ground.unknown) & ~thing.cells
    seen = np.ones(len(places), bool)
    for beside in (0.0, BESIDE, -BESIDE):
        targets = np.array(thing.centre) + beside * left
        seen &= ground.sees(_fractional(ground, places), _fractional(ground, targets), opaque)
    return seen


def _fractional(ground: Ground, points: FloatArray) -> FloatArray:
    """Return points (N, 2; m) in (row, column), cells' middles being whole numbers."""
    grid = ground.grid
    result: FloatArray = (points[:, ::-1] - (grid.origin_y, grid.origin_x)) / grid.resolution - 0.5
    return result


def _cells(ground: Ground, points: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    rows, columns = ground.grid.cells_of(points)
    shape = ground.grid.cells.shape
    return rows.clip(0, shape[0] - 1), columns.clip(0, shape[1] - 1)


def _lookup(ground: Ground, mask: Mask, points: FloatArray) -> Mask:
    """Return a mask's values at points (..., 2), False beyond the map."""
    rows, columns = ground.grid.cells_of(points)
    clipped = _cells(ground, points)
    found: Mask = mask[clipped] & (rows == clipped[0]) & (columns == clipped[1])
    return found
