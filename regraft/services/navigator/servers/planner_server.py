"""The planner server: ways on the map as actions and services of their own."""

from __future__ import annotations

import numpy as np

from regraft import Parameter, RefusalCode, RequestRefused, action, every, service
from regraft.bus_schema.messages.geometry import FramedPose
from regraft.bus_schema.messages.nav2.paths import (
    MAX_GOALS,
    NO_VIAPOINTS,
    THROUGH_POSES,
    ClearCostmap,
    ComputedPath,
    ComputePathThroughPoses,
    ComputePathToPose,
    CostmapCleared,
    Costs,
    GetCosts,
    Path,
    PathValidity,
    PlanError,
    SmoothedPath,
    SmoothError,
    SmoothPath,
    ValidatePath,
)
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.suggestions import near
from regraft.planar import FloatArray, Pose2D
from regraft.services.navigator.conversions import planar_pose
from regraft.services.navigator.planning.grid_planner import NO_POINTS
from regraft.services.navigator.planning.smoothing import smooth
from regraft.services.navigator.planning.terrain import Ground, Terrain
from regraft.services.navigator.servers.costs import INSCRIBED, LETHAL, UNKNOWN, costs_of, footprint_cost
from regraft.services.navigator.servers.map_user import MapUser
from regraft.services.navigator.servers.paths import ahead_of, path_of
from regraft.services.navigator.servers.planning import PLANNERS, STATIC_GRID, PathFinder, PlanningFailed
from regraft.services.navigator.servers.surroundings import Area, check_frame, frame_problem

SMOOTHERS = {"simple_smoother": 1, "route_smoother": 8}
"""The smoothers, and how often each rounds what the planner rounds once."""
LAYERS = ("", "static")


class PlannerServer(MapUser):
    """Finds, checks and smooths paths on the map and around the obstacles that the lidar has shown.

    It drives nothing. Names and error codes are those of Nav2's planner, smoother and global costmap.
    """

    resources = Resources(cpu=0.04, memory=30.0)
    handler_timeout = 2.0  # a path through many poses

    update_frequency = Parameter(
        20.0,
        "how often what the senses show is taken in, besides at each request",
        minimum=2.0,  # less often, jumps of the pose pass for motion
        maximum=100.0,
        unit="Hz",
        read_only=True,
    )
    goal_tolerance = Parameter(
        0.5, "how far from an impossible goal a path may end instead", minimum=0.0, maximum=5.0, unit="m"
    )

    @every(hz=update_frequency)
    def watch(self) -> None:
        """Take in what the senses show."""
        self._look()

    @action("compute_path_to_pose")
    async def compute_path_to_pose(self, goal: ComputePathToPose) -> ComputedPath:
        """Find a way to a pose."""
        await self._get_ready()
        try:
            return ComputedPath(await self._path(goal.start, (*goal.viapoints, goal.goal), goal.planner))
        except PlanningFailed as error:
            return ComputedPath(Path(), int(error.code), str(error))

    @action("compute_path_through_poses")
    async def compute_path_through_poses(self, goal: ComputePathThroughPoses) -> ComputedPath:
        """Find a way through several poses."""
        await self._get_ready()
        if not goal.goals:
            return ComputedPath(Path(), NO_VIAPOINTS, "the goal has no poses; it needs at least one")
        try:
            return ComputedPath(await self._path(goal.start, goal.goals, goal.planner))
        except PlanningFailed as error:
            return ComputedPath(Path(), int(error.code) + THROUGH_POSES, str(error))

    @action("smooth_path")
    async def smooth_path(self, goal: SmoothPath) -> SmoothedPath:
        """Round the corners of a path."""
        await self._get_ready()
        name = goal.smoother or next(iter(SMOOTHERS))
        if name not in SMOOTHERS:
            why = _unknown("smoother", name, SMOOTHERS)
            return SmoothedPath(error_code=int(SmoothError.INVALID_SMOOTHER), error_msg=why)
        if len(goal.path.poses) < 2:
            why = f"the path has {len(goal.path.poses)} poses; it needs at least 2"
            return SmoothedPath(error_code=int(SmoothError.INVALID_PATH), error_msg=why)
        if problem := frame_problem(goal.path.frame):
            return SmoothedPath(error_code=int(SmoothError.INVALID_PATH), error_msg=f"the path: {problem}")
        return self._smoothed(goal, SMOOTHERS[name])

    @service("is_path_valid")
    def is_path_valid(self, request: ValidatePath) -> PathValidity:
        """Return whether the robot can still drive along a path."""
        self._look()
        if request.layer not in LAYERS:
            why = f"must be {' or '.join(repr(layer) for layer in LAYERS)}, is {request.layer!r}"
            raise RequestRefused(why, RefusalCode.INVALID, field="layer")
        if problem := frame_problem(request.path.frame):
            raise RequestRefused(problem, RefusalCode.INVALID, field="path")
        if self._surroundings.missing():
            return PathValidity(False, False)
        points = request.path.rows[:, :2]
        if not len(points):
            return PathValidity(True, False)
        first, end = ahead_of(points, self._surroundings.pose.position, request.max_lookahead_distance)
        costs = self._costs(points[first:end], self._terrain(request.layer))
        # 253 is nearer than the robot's half width: it touches something in whichever direction it looks.
        bad = costs >= min(float(request.max_cost), INSCRIBED)
        unknown = costs == UNKNOWN
        bad = bad | unknown if request.consider_unknown_as_obstacle else bad & ~unknown
        invalid = (np.flatnonzero(bad) + first).tolist()
        return PathValidity(True, not invalid, tuple(invalid[:1] if request.stop_at_first_collision else invalid))

    @service("global_costmap/get_cost_global_costmap")
    def get_costs(self, request: GetCosts) -> Costs:
        """Return what it costs to be at some places."""
        self._look()
        if self._surroundings.missing():
            return Costs(False)
        for pose in request.poses:
            _check(pose, "poses")
        terrain = self._terrain("")
        poses = [planar_pose(pose.pose) for pose in request.poses]
        points = np.array([pose.position for pose in poses]).reshape(-1, 2)
        costs = self._costs(points, terrain)
        if request.use_footprint:
            outlines = np.array([footprint_cost(pose, self._footprint, terrain) for pose in poses])
            costs = np.where(outlines >= LETHAL, outlines, np.minimum(costs, INSCRIBED - 1))
        return Costs(True, tuple(costs.tolist()))

    @service("global_costmap/clear_entirely_global_costmap")
    def clear_costmap(self, request: ClearCostmap) -> CostmapCleared:
        """Forget all obstacles that were seen."""
        return self._forget(request, Area.EVERYWHERE)

    @service("global_costmap/clear_except_global_costmap")
    def clear_except(self, request: ClearCostmap) -> CostmapCleared:
        """Forget the obstacles that were seen outside of a square around the robot."""
        return self._forget(request, Area.OUTSIDE)

    @service("global_costmap/clear_around_global_costmap")
    def clear_around(self, request: ClearCostmap) -> CostmapCleared:
        """Forget the obstacles that were seen in a square around the robot."""
        return self._forget(request, Area.AROUND_ROBOT)

    @service("global_costmap/clear_around_pose_global_costmap")
    def clear_around_pose(self, request: ClearCostmap) -> CostmapCleared:
        """Forget the obstacles that were seen in a square around a pose."""
        return self._forget(request, Area.AROUND_POSE)

    async def _path(self, start: FramedPose | None, goals: tuple[FramedPose, ...], planner: str) -> Path:
        if planner and planner not in PLANNERS:
            raise PlanningFailed(PlanError.INVALID_PLANNER, _unknown("planner", planner, PLANNERS))
        if len(goals) > MAX_GOALS:
            raise PlanningFailed(PlanError.UNKNOWN, f"{len(goals)} poses are too many; {MAX_GOALS} are allowed")
        here = self._surroundings.pose
        if start is not None:
            try:
                check_frame("start", start.frame)
            except ValueError as error:
                raise PlanningFailed(PlanError.NO_POSE, str(error)) from None
            here = planar_pose(start.pose)
        unmapped = NO_POINTS if planner == STATIC_GRID else self._surroundings.sight.unmapped
        finder = PathFinder(self._surroundings.planner, unmapped, self.goal_tolerance)
        return await finder.through(self.kit.now(), here, goals, lambda: self.kit.sleep(0.0))

    def _smoothed(self, goal: SmoothPath, times: int) -> SmoothedPath:
        terrain = self._terrain("")
        ground = Ground(terrain, terrain.free)
        points = goal.path.rows[:, :2]
        for _ in range(times):
            points = smooth(points, ground)
        path = path_of(self.kit.now(), points, goal.path.poses[-1].yaw)
        touches = bool((self._costs(points, terrain)[1:-1] >= INSCRIBED).any())
        if goal.check_for_collisions and touches:
            why = "the smoothed path comes too close to an obstacle"
            return SmoothedPath(path, 0.0, False, int(SmoothError.SMOOTHED_PATH_IN_COLLISION), why)
        return SmoothedPath(path, 0.0, True)

    def _terrain(self, layer: str) -> Terrain:
        seen = NO_POINTS if layer == "static" else self._surroundings.sight.unmapped
        return self._surroundings.planner.terrain(seen)

    def _costs(self, points: FloatArray, terrain: Terrain) -> FloatArray:
        return costs_of(points, terrain, self._footprint.half_width, self._inflation.fades)


def _check(pose: FramedPose, field: str) -> Pose2D:
    if problem := frame_problem(pose.frame):
        raise RequestRefused(problem, RefusalCode.INVALID, field=field)
    return planar_pose(pose.pose)


def _unknown(what: str, name: str, known: object) -> str:
    names = list(known) if isinstance(known, dict | tuple) else []
    meant = near(name, names)
    hint = f"; did you mean {meant!r}?" if meant else ""
    return f"there is no {what} {name!r}; there is: {', '.join(names)}{hint}"
