"""Finding ways between poses, with a code for each way to fail."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.messages.geometry import FramedPose
from regraft.bus_schema.messages.nav2.paths import MAX_POSES, Path, PlanError
from regraft.planar import FloatArray, Point, Pose2D
from regraft.services.navigator.conversions import planar_pose
from regraft.services.navigator.planning.grid_planner import NO_POINTS, GridPlanner, NoPath
from regraft.services.navigator.planning.route import MAP_ERROR
from regraft.services.navigator.servers.paths import joined, path_of
from regraft.services.navigator.servers.surroundings import check_frame

GRID_BASED: Final = "GridBased"
"""Around the obstacles of the map and those that were seen."""
STATIC_GRID: Final = "StaticGrid"
"""Around the obstacles of the map alone."""
AT_ONCE: Final = 50
"""Goals to which the ways are found without a pause, on small maps."""
CELLS_AT_ONCE: Final = 4_000_000
"""Cells of maps, one for each goal, in which ways are found without a pause: a second of work."""
PLANNERS: Final = (GRID_BASED, STATIC_GRID)


class PlanningFailed(Exception):
    """There is no path; ``code`` is for programs."""

    def __init__(self, code: PlanError, why: str) -> None:
        super().__init__(why)
        self.code = code


@dataclass(frozen=True, slots=True)
class PathFinder:
    """Finds paths on one map.

    ``unmapped`` (N, 2) are obstacles that it lacks. A goal at which the robot cannot be is replaced by the nearest
    place within ``tolerance`` (m).
    """

    planner: GridPlanner
    unmapped: FloatArray
    tolerance: float

    async def through(
        self, stamp: float, start: Pose2D, goals: tuple[FramedPose, ...], pause: Callable[[], Awaitable[None]]
    ) -> Path:
        """Return the path from ``start`` through ``goals``; raises PlanningFailed.

        After so many goals there is a ``pause``, in which others may do something: after fewer on a large map.
        """
        at_once = max(1, min(AT_ONCE, CELLS_AT_ONCE // self.planner.grid.cells.size))
        legs: list[Path] = []
        here = start.position
        length = 1
        for number, goal in enumerate(goals):
            if number and number % at_once == 0:
                await pause()
            try:
                check_frame(f"goal {number + 1}", goal.frame)
            except ValueError as error:
                raise PlanningFailed(PlanError.NO_POSE, str(error)) from None
            points = self._leg(here, planar_pose(goal.pose))
            length += len(points) - 1
            if length > MAX_POSES:
                why = f"the path to goal {number + 1} has {length} poses; {MAX_POSES} are allowed"
                raise PlanningFailed(PlanError.UNKNOWN, why)
            legs.append(path_of(stamp, points, goal.pose.yaw))
            here = (float(points[-1, 0]), float(points[-1, 1]))
        return joined(stamp, legs)

    def _leg(self, here: Point, goal: Pose2D) -> FloatArray:
        planner = self.planner
        start = planner.leave_obstacle(here, MAP_ERROR, self.unmapped)
        self._check("start", start, PlanError.START_OUTSIDE_MAP, PlanError.START_OCCUPIED)
        self._check("goal", goal.position, PlanError.GOAL_OUTSIDE_MAP, None)
        try:
            target = planner.approach(start, goal.position, self.tolerance)
            self._check("goal", target, PlanError.GOAL_OUTSIDE_MAP, PlanError.GOAL_OCCUPIED)
            return planner.plan(start, target, self.unmapped)
        except NoPath as error:
            raise PlanningFailed(PlanError.NO_VALID_PATH, str(error)) from None

    def _check(self, name: str, point: Point, outside: PlanError, occupied: PlanError | None) -> None:
        """Make sure that a point lies on free ground of the map alone: what was seen there may leave."""
        grid, where = self.planner.grid, f"({point[0]:.3f}, {point[1]:.3f})"
        if not grid.contains(point):
            raise PlanningFailed(outside, f"the {name} {where} is outside the map, which spans {grid.extent()}")
        if occupied is not None and not self.planner.terrain(NO_POINTS).open[grid.cell_of(point)]:
            raise PlanningFailed(occupied, f"the {name} {where} is inside an obstacle of the map")
