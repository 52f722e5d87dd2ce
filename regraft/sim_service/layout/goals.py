"""Where a robot must stand to look at things."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from regraft.planar import Pose2D
from regraft.sim_service.layout.ground_map import FREE, GroundMap, Rasteriser
from regraft.sim_service.layout.headings import wrap_heading
from regraft.sim_service.layout.scene import Scene

BEARINGS = tuple(2.0 * math.pi * k / 72 for k in range(72))
"""Directions (rad) from the object in which a robot may stand."""
STANDOFFS = (0.8, 0.9, 0.7, 1.0, 0.6)
"""Distances (m) from the object's outline, best first."""
MARGIN = 0.08
ENOUGH_ROOM = 0.5
"""More room (m) than this around a pose is no better."""
SIGHT_OFFSETS = (-0.15, 0.0, 0.15)
"""Where (m, left of straight ahead) lines of sight must be free."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ViewingGoal:
    """A pose (map frame) from which the named body is straight ahead, near, and in free sight."""

    name: str
    pose: Pose2D


class GoalError(ValueError):
    """No pose to look at a body from."""


def viewing_goals(
    scene: Scene, rasteriser: Rasteriser, group: str, start: Pose2D, radius: float
) -> tuple[ViewingGoal, ...]:
    """Return a viewing pose for each body of the MJCF tuple `group`, in its order.

    Each is in free space with room for a robot of this radius (m). It can be reached from the start. Nothing is between
    it and the object at the grid's height. Of several, the one with most room around it is taken.

    Raises:
        SceneError: there is no such tuple.
        GoalError: a body can't be seen from any such pose, or the robot starts where it has no room.
    """
    search = _Search(rasteriser.map(), start, radius)
    return tuple(
        ViewingGoal(body, search.pose(body, rasteriser.body_cells(body))) for body in scene.bodies_of_tuple(group)
    )


@contextmanager
def _one_thread() -> Iterator[None]:
    """Have OpenCV start no threads: a process that is forked later would wait for them for ever."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


class _Search:
    def __init__(self, ground_map: GroundMap, start: Pose2D, radius: float) -> None:
        self._map = ground_map
        self._radius = radius
        free = (ground_map.occupancy == FREE).astype(np.uint8)
        with _one_thread():
            cells = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
            # The transform measures between the middles of cells; the obstacle begins half a cell earlier.
            self._room = (cells - 0.5) * ground_map.resolution
            passable = (self._room >= self._radius).astype(np.uint8)
            _, self._regions = cv2.connectedComponents(passable, connectivity=4)
        has_room = ground_map.is_free(start.x, start.y)
        self._start_region = int(self._regions[ground_map.cell(start.x, start.y)]) if has_room else 0
        if self._start_region == 0:
            raise GoalError(f"the robot has no room at its start ({start.x:.2f}, {start.y:.2f})")

    def pose(self, body: str, cells: npt.NDArray[np.bool_]) -> Pose2D:
        rows, columns = np.nonzero(cells)
        if len(rows) == 0:
            raise GoalError(f"body {body!r} does not reach the height of the map, so nothing can face it")
        origin, resolution = self._map.origin, self._map.resolution
        middle_x = origin[0] + (float(columns.min() + columns.max()) / 2.0 + 0.5) * resolution
        middle_y = origin[1] + (float(rows.min() + rows.max()) / 2.0 + 0.5) * resolution
        outlines = self._outlines(middle_x, middle_y, cells)
        for standoff in STANDOFFS:
            poses = [
                Pose2D(
                    middle_x + (outline + standoff) * math.cos(bearing),
                    middle_y + (outline + standoff) * math.sin(bearing),
                    wrap_heading(bearing + math.pi),
                )
                for bearing, outline in zip(BEARINGS, outlines, strict=True)
            ]
            rooms = [self._room_at(pose) for pose in poses]
            # Most room first, and of equal ones the first bearing. Lines of sight cost most, and few are needed.
            for index in sorted(range(len(poses)), key=lambda index: -rooms[index]):
                if rooms[index] > 0.0 and self._sight(poses[index], standoff, cells):
                    return poses[index]
        raise GoalError(f"no free pose from which the robot could look at {body!r}")

    def _room_at(self, pose: Pose2D) -> float:
        """Return the room (m) at a pose, up to `ENOUGH_ROOM`; 0 if it is too little, or out of reach."""
        if not self._map.is_free(pose.x, pose.y):
            return 0.0
        cell = self._map.cell(pose.x, pose.y)
        room = float(self._room[cell])
        reachable = int(self._regions[cell]) == self._start_region
        return min(room, ENOUGH_ROOM) if reachable and room >= self._radius + MARGIN else 0.0

    def _outlines(self, x: float, y: float, cells: npt.NDArray[np.bool_]) -> list[float]:
        """Return how far (m) the body reaches from its middle (x, y) in each of the directions."""
        origin, resolution = self._map.origin, self._map.resolution
        distances = np.arange(0.0, _diagonal(cells) * resolution, resolution / 2.0)
        cosines, sines = (np.array([[function(bearing)] for bearing in BEARINGS]) for function in (math.cos, math.sin))
        columns = np.floor((x + distances * cosines - origin[0]) / resolution).astype(int)
        rows = np.floor((y + distances * sines - origin[1]) / resolution).astype(int)
        reached = (rows >= 0) & (rows < cells.shape[0]) & (columns >= 0) & (columns < cells.shape[1])
        reached[reached] = cells[rows[reached], columns[reached]]
        outlines: list[float] = np.where(reached, distances, 0.0).max(axis=1).tolist()
        return outlines

    def _sight(self, pose: Pose2D, standoff: float, cells: npt.NDArray[np.bool_]) -> bool:
        """Return whether nothing but the object itself stands ahead of the pose, up to the object's outline."""
        step = self._map.resolution / 2.0
        cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
        for offset in SIGHT_OFFSETS:
            for ahead in np.arange(0.0, standoff, step).tolist():
                x = pose.x + ahead * cosine - offset * sine
                y = pose.y + ahead * sine + offset * cosine
                if not (self._map.is_free(x, y) or self._contains(cells, x, y)):
                    return False
        return True

    def _contains(self, cells: npt.NDArray[np.bool_], x: float, y: float) -> bool:
        row, column = self._map.cell(x, y)
        rows, columns = cells.shape
        return 0 <= row < rows and 0 <= column < columns and bool(cells[row, column])


def _diagonal(cells: npt.NDArray[np.bool_]) -> float:
    """Return the diagonal, in cells, of the rectangle around those that are set: none is farther from its middle."""
    rows, columns = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    return math.hypot(float(rows[-1] - rows[0] + 1), float(columns[-1] - columns[0] + 1))
