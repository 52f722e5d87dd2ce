"""Frontiers: where known ground ends at unknown ground (B. Yamauchi, CIRA 1997)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.ndimage import binary_dilation, find_objects, label  # type: ignore[import-untyped, unused-ignore]

from regraft.planar import FloatArray, Point, Pose2D
from regraft.services import robot_parameters as usual
from regraft.services.explorer.ground import EIGHT, Cells, Ground, Mask

TARGETS = 7
"""How many cells of a frontier a view is judged by."""
VIEWS = 64
"""How many places a frontier is looked at from, to find a good one."""
MOST = 0.5
"""A view of less than this part is taken only if there is no other."""
SAME_PLACE = 0.20
"""m: what is nearer to a useless place is no better."""
NEARLY = 0.75
"""A view that shows this part of what the best one shows is as good, if it is nearer."""


@dataclass(frozen=True, slots=True)
class FrontierSettings:
    """The definition of a frontier, and of the places from which it is looked at; in m and m².

    `min_length` is that of the frontier, `min_area` that of the unknown ground behind it: less is noise.
    The robot turns where it has `turning_room`, and stands nearer to things (`radius`) where it must. Its lidar reaches
    `range_max`: it looks from `near`, or from `far` if it has to.
    """

    radius: float = usual.RADIUS
    turning_room: float = usual.TURNING_ROOM
    min_length: float = 0.20
    min_area: float = 0.03
    range_max: float = usual.RANGE_MAX

    @property
    def near(self) -> float:
        """From here (m) a frontier is seen well."""
        return self.range_max * 3 / 7

    @property
    def far(self) -> float:
        """From here (m) a frontier is seen at all."""
        return self.range_max * 6 / 7


@dataclass(frozen=True, slots=True)
class Frontier:
    """A frontier: a point in the unknown just behind its middle (m), and how to look at it.

    `goal` is where a robot can stand and sees that point or most of the rest, facing it. `length` (m) is that
    of the frontier, `distance` (m) that of the way to the goal.
    """

    target: Point
    goal: Pose2D
    length: float
    distance: float


def find_frontiers(ground: Ground, settings: FrontierSettings, useless: Sequence[Point] = ()) -> list[Frontier]:
    """Return the frontiers that a robot can look behind, in the order of the map's rows.

    It is not sent to where it is close to a `useless` place (m): what can be seen from there has been seen.
    """
    unknown, edge = _edge(ground, settings)
    clusters, _ = label(edge, EIGHT)
    lengths = np.bincount(clusters.ravel()) * ground.grid.resolution
    large = [number for number in range(1, len(lengths)) if lengths[number] >= settings.min_length - 1e-9]
    if not large:
        return []
    standing = _Standing(ground, settings, useless)
    boxes = find_objects(clusters)
    found = []
    for number in large:
        behind = _behind(clusters, number, boxes[number - 1], unknown)
        view = standing.view(behind)
        if view is not None:
            target, goal, distance = view
            found.append(Frontier(target, goal, float(lengths[number]), distance))
    return found


def _edge(ground: Ground, settings: FrontierSettings) -> tuple[Mask, Mask]:
    """Return the unknown cells that matter, and the free ones next to them that the robot's ground continues to.

    Free streaks behind walls are no part of that ground, as noise lets single beams through a wall's gaps.
    """
    regions, _ = label(ground.free & ~ground.walls)
    inside = np.unique(regions[ground.reachable & (regions > 0)])
    seen = np.isin(regions, inside) & (regions > 0)
    pockets, _ = label(ground.unknown & ~ground.walls)
    sizes = np.bincount(pockets.ravel()) * ground.grid.resolution**2
    sizes[0] = 0.0
    unknown: Mask = (sizes >= settings.min_area)[pockets]
    edge: Mask = seen & binary_dilation(unknown)
    return unknown, edge


def _behind(clusters: Cells, number: int, box: tuple[slice, slice], unknown: Mask) -> Cells:
    """Return the unknown cells next to a cluster."""
    rows = slice(max(box[0].start - 1, 0), box[0].stop + 1)
    columns = slice(max(box[1].start - 1, 0), box[1].stop + 1)
    beside = binary_dilation(clusters[rows, columns] == number) & unknown[rows, columns]
    cells: Cells = np.argwhere(beside) + np.array([rows.start, columns.start])
    return cells


class _Standing:
    """The places where the robot can stand, and what it sees from them."""

    def __init__(self, ground: Ground, settings: FrontierSettings, useless: Sequence[Point]) -> None:
        self._ground = ground
        self._ways: FloatArray = ground.ways(np.array([ground.start]))[0]
        reachable = ground.reachable & np.isfinite(self._ways)
        for place in useless:
            reachable &= ~ground.within(place, SAME_PLACE)
        # Unknown ground may hold an obstacle, so it is better not to stand at its very edge.
        roomy = np.argwhere(reachable & (ground.room >= settings.turning_room))
        tight = np.argwhere(reachable)
        self._choices = [
            (roomy, settings.near),
            (tight, settings.near),
            (roomy, settings.far),
            (tight, settings.far),
        ]

    def view(self, behind: Cells) -> tuple[Point, Pose2D, float] | None:
        """Return a frontier's target, the pose to look at it and the length of the way there; None if there is none."""
        middle = behind[np.argmin(np.hypot(*(behind - behind.mean(axis=0)).T))]
        spread = np.linspace(0, len(behind) - 1, min(TARGETS, len(behind))).round().astype(int)
        targets = np.vstack([middle, behind[spread]])
        target = self._ground.point((int(middle[0]), int(middle[1])))
        for least, (places, within) in product((MOST, 0.0), self._choices):
            place = self._nearest_view(places, targets, within / self._ground.grid.resolution, least)
            if place is not None:
                x, y = self._ground.point(place)
                yaw = math.atan2(target[1] - y, target[0] - x)
                return target, Pose2D(x, y, yaw), float(self._ways[place])
        return None

    def _nearest_view(self, places: Cells, targets: Cells, within: float, least: float) -> tuple[int, int] | None:
        """Return the place (cell) nearest to the first target that shows almost the most, and at least a part."""
        # The places are in the order of their rows: on a large map few are near.
        row = float(targets[0, 0])
        rows = places[:, 0]
        places = places[np.searchsorted(rows, row - within) : np.searchsorted(rows, row + within, side="right")]
        away = np.hypot(*(places - targets[0]).T)
        order = np.argsort(away, kind="stable")
        order = order[: np.searchsorted(away[order], within, side="right")]
        if not len(order):
            return None
        order = order[np.linspace(0, len(order) - 1, min(VIEWS, len(order))).round().astype(int)]
        eyes = np.repeat(places[order], len(targets), axis=0).astype(float)
        lines = self._ground.sees(eyes, np.tile(targets, (len(order), 1)).astype(float))
        seen = lines.reshape(len(order), len(targets)).sum(axis=1)
        good = seen >= max(1.0, NEARLY * float(seen.max()), least * len(targets))
        if not good.any():
            return None
        place = places[order[np.argmax(good)]]
        return int(place[0]), int(place[1])
