"""Keeping a path to the goal while the map grows and obstacles come and go."""

import math
from typing import Any

import numpy as np

from regraft.planar import FloatArray, Point, Pose2D
from regraft.services.navigator.planning.grid_planner import NO_POINTS, GridPlanner, NoPath, Path
from regraft.services.navigator.polyline import lengths_along, polyline_length

# m: the path is watched this far ahead, and to each side this much farther than the robot reaches.
WATCHED_AHEAD = 1.5
WATCHED_MARGIN = 0.027
# A new path is taken only if it costs this much less, lest the robot dither between two.
CHEAPER = 0.95
OFF_PATH = 0.15  # m
WORSE = 1.05  # times what the path cost before, on a new map: reason to look for another at once,
LEISURE = 3.0  # and otherwise only after so many periods
SOON = 0.3  # s between plans around something that is in the way
# A robot can't stand in an obstacle: a map that has it there is off by at most this (m).
MAP_ERROR = 0.25


class Route:
    """The path to one goal: planned when there is a reason to, kept as long as it is about as good as any.

    `period` is the time (s) between plans. `reach` is how far (m) from an impossible goal the robot may be sent
    instead. `half_width` is how far (m) it reaches to each side.
    """

    def __init__(self, period: float, reach: float, half_width: float) -> None:
        self._period, self._reach = period, reach
        self._watched_aside = round(half_width + WATCHED_MARGIN, 6)
        self._take(NO_POINTS)
        self.first_length = 0.0
        """How long (m) the path was at the start."""
        self.no_path = ""
        """Why the last plan found none, or none around the obstacles seen; empty if it did."""
        self.impossible_since: float | None = None
        """Since when (s) not even the map alone leaves a way."""
        self._target: Point | None = None
        self._planned_at = -math.inf
        self._planned_around: FloatArray = NO_POINTS
        self._stale = False
        self._new_map = False
        self._worth = math.inf
        self._no_way_around = False

    @property
    def path(self) -> Path:
        """The path to follow, (N, 2) in m in the map's frame; empty before the first plan."""
        return self._path

    def use(self, planner: GridPlanner) -> None:
        """Take notice of a new map: the path stays until it is blocked or found to be worse than another."""
        self._new_map = True
        worth = planner.cost(self._path)
        self._stale = self._stale or worth > WORSE * self._worth or self.impossible_since is not None
        if worth == math.inf:
            self._planned_at = -math.inf
        # A goal that was taken as given is kept, unless there is no room for the robot after all.
        if self._target is not None and not planner.roomy(self._target):
            self._target = None
            self._stale = True

    def renew(self) -> None:
        """Plan at the next opportunity."""
        self._planned_at = -math.inf
        self._stale = True

    def keep(self, time: float, pose: Pose2D, goal: Pose2D, planner: GridPlanner, unmapped: FloatArray) -> bool:
        """Plan where that is due; return whether there is a path to follow.

        `unmapped` (N, 2) are the obstacles seen that the map lacks.
        """
        since = time - self._planned_at
        if since < 0.0:
            since = math.inf  # the clock was set back
        wait = self._period if self._no_way_around else SOON
        blocked = since >= wait and self._blocked(pose, unmapped)
        if blocked or self._due(since, pose, unmapped):
            self._planned_at, self._planned_around = time, unmapped
            self._stale = self._new_map = False
            self._replan(time, pose, goal, planner, blocked)
            self._no_way_around = blocked and self._blocked(pose, unmapped)
        return len(self.path) > 0

    def distance_left(self, pose: Pose2D) -> float:
        """Return how far (m) it is to the path and along it to its end."""
        nearest = self._nearest(pose)
        x, y = self._path[nearest]
        return math.hypot(x - pose.x, y - pose.y) + float(self._along[-1] - self._along[nearest])

    def remaining(self, pose: Pose2D) -> FloatArray:
        """Return the part of the path that is still to be driven."""
        if not len(self.path):
            return self.path
        return self._path[self._nearest(pose) :]

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return {
            "path": self.path.tolist(),
            "first_length": self.first_length,
            "no_path": self.no_path,
            "impossible_since": self.impossible_since,
            "target": None if self._target is None else list(self._target),
            "planned_at": self._planned_at,
            "planned_around": self._planned_around.tolist(),
            "stale": self._stale,
            "new_map": self._new_map,
            "worth": self._worth,
            "no_way_around": self._no_way_around,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self._take(_points(state["path"]))
        self.first_length, self.no_path = state["first_length"], state["no_path"]
        self.impossible_since = state["impossible_since"]
        self._target = None if state["target"] is None else (state["target"][0], state["target"][1])
        self._planned_at, self._planned_around = state["planned_at"], _points(state["planned_around"])
        self._stale, self._new_map = state["stale"], state["new_map"]
        self._worth, self._no_way_around = state["worth"], state["no_way_around"]

    def _take(self, path: Path) -> None:
        self._path = path
        self._along = lengths_along(path)

    def _nearest(self, pose: Pose2D) -> int:
        offsets = self._path - (pose.x, pose.y)
        return int(np.einsum("ij,ij->i", offsets, offsets).argmin())

    def _due(self, since: float, pose: Pose2D, unmapped: FloatArray) -> bool:
        """Return whether it is time to plan, so long (s) after the last plan."""
        if since < self._period:
            return False
        if self._stale or not len(self._path) or self._off(pose):
            return True
        # New knowledge does not hinder; it may have opened a shorter way.
        learnt = self._new_map or not np.array_equal(unmapped, self._planned_around)
        return learnt and since >= LEISURE * self._period

    def _off(self, pose: Pose2D) -> bool:
        nearest = self._nearest(pose)
        x, y = self._path[nearest]
        return math.hypot(x - pose.x, y - pose.y) > OFF_PATH

    def _replan(self, time: float, pose: Pose2D, goal: Pose2D, planner: GridPlanner, blocked: bool) -> None:
        unmapped = self._planned_around
        start = planner.leave_obstacle(pose.position, MAP_ERROR, unmapped)
        try:
            path = self._plan(start, goal, planner, unmapped)
        except NoPath as error:
            self.no_path = str(error)
            self.impossible_since = time if self.impossible_since is None else self.impossible_since
            return
        self.impossible_since = None
        old = self.remaining(pose)
        off = len(old) == 0 or self._off(pose)
        moved = len(old) > 0 and self._target is not None and not np.allclose(old[-1], self._target)
        if off or blocked or moved or planner.cost(path, unmapped) < CHEAPER * planner.cost(old, unmapped):
            self._take(path)
        self._worth = planner.cost(self._path)

    def _plan(self, start: Point, goal: Pose2D, planner: GridPlanner, unmapped: FloatArray) -> Path:
        if self._target is None:
            target = planner.approach(start, goal.position, self._reach)
            if not len(self.path):
                self.first_length = polyline_length(planner.plan(start, target))
            self._target = target
        try:
            path = planner.plan(start, self._target, unmapped)
            self.no_path = ""
        except NoPath as error:
            # The obstacle may be someone who will leave: go as near as the obstacles allow.
            path = planner.plan(planner.leave_obstacle(start, MAP_ERROR), self._target)
            self.no_path = str(error)
        return path

    def _blocked(self, pose: Pose2D, unmapped: FloatArray) -> bool:
        """Return whether something that the map lacks stands on the path ahead."""
        if not len(unmapped) or not len(self.path):
            return False
        ahead = self.remaining(pose)[::2]
        ahead = ahead[np.hypot(ahead[:, 0] - pose.x, ahead[:, 1] - pose.y) <= WATCHED_AHEAD]
        gaps = np.hypot(ahead[:, None, 0] - unmapped[None, :, 0], ahead[:, None, 1] - unmapped[None, :, 1])
        return bool(gaps.min(initial=math.inf) < self._watched_aside)


def _points(rows: list[list[float]]) -> FloatArray:
    return np.array(rows, dtype=np.float64).reshape(-1, 2)
