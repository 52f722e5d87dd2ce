"""The leaves that ask the planner server for paths."""

from __future__ import annotations

from typing import Any

from behavior_tree import SUCCESS, Input, Output, Status
from regraft.bus_schema.messages.geometry import FramedPose
from regraft.bus_schema.messages.nav2.paths import (
    ComputedPath,
    ComputePathThroughPoses,
    ComputePathToPose,
    Path,
    PathValidity,
    PlanError,
    SmoothedPath,
    SmoothError,
    SmoothPath,
    ValidatePath,
)
from regraft.services.bt_executor.leaves.asking_leaf import write_if_connected
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.nav2.poses import goals_of, path_at, pose_at, pose_at_or_none, pose_of
from regraft.services.bt_executor.leaves.nav2.server_leaf import ServerAction, ServerCall


class _PathLeaf(ServerAction):
    """The base: writes the path, an empty one if there is none."""

    found = Output[Any](name="path", description="the path, empty if there is none")

    def answered(self, answer: ComputedPath) -> Status:
        """Write the path."""
        write_if_connected(self, "path", answer.path)
        return self.ended(answer)

    def aborted(self, code: int, why: str) -> Status:
        """Write that there is no path."""
        write_if_connected(self, "path", Path())
        return super().aborted(code, why)

    def on_halted(self) -> None:
        """Give up; there is no path then, as in Nav2."""
        super().on_halted()
        write_if_connected(self, "path", Path())


class ComputePathToPoseLeaf(_PathLeaf):
    """Asks for a path from the robot, or from ``start``, to a goal."""

    server = "compute_path_to_pose"
    unknown = int(PlanError.UNKNOWN)
    required_ports = ("goal",)

    goal = Input[Any](description="where to")
    start = Input[Any](description="where from; by default where the robot is")
    use_start = Input(bool, description="whether start counts; by default if it is given")
    viapoints = Input[Any](description="poses to pass on the way")
    planner_id = Input(str, default="", description="the planner, such as GridBased")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        viapoints = tuple(map(pose_of, goals_of(self.read_port_or("viapoints"))))
        goal = ComputePathToPose(pose_at(self, "goal"), self._start(), viapoints, self.read_port_or("planner_id", ""))
        return self.give(goal, ComputedPath)

    def _start(self) -> FramedPose | None:
        return pose_at_or_none(self, "start") if self.read_port_or("use_start", True) else None


class ComputePathThroughPosesLeaf(_PathLeaf):
    """Asks for a path from the robot, or from ``start``, through goals in their order."""

    server = "compute_path_through_poses"
    unknown = 300
    required_ports = ("goals",)

    goals = Input[Any](description="through where: a list of goals")
    start = Input[Any](description="where from; by default where the robot is")
    planner_id = Input(str, default="", description="the planner, such as GridBased")
    last_reached_index = Output(int, description="always -1: a path through some of the goals only is none here")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        goals = tuple(map(pose_of, goals_of(self.read_port_or("goals"))))
        goal = ComputePathThroughPoses(goals, pose_at_or_none(self, "start"), self.read_port_or("planner_id", ""))
        write_if_connected(self, "last_reached_index", -1)
        return self.give(goal, ComputedPath)


class SmoothPathLeaf(ServerAction):
    """Asks for a path with rounded corners."""

    server = "smooth_path"
    unknown = int(SmoothError.UNKNOWN)
    required_ports = ("unsmoothed_path",)

    unsmoothed_path = Input[Any](description="the path")
    max_smoothing_duration = Input(float, default=3.0, description="seconds that it may take")
    check_for_collisions = Input(bool, default=False, description="whether a result that touches something fails")
    smoother_id = Input(str, default="", description="the smoother, such as simple_smoother")
    smoothed_path = Output[Any](description="the result")
    smoothing_duration = Output(float, description="seconds that it took")
    was_completed = Output(bool, description="whether it was done to the end")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        path = path_at(self, "unsmoothed_path")
        goal = SmoothPath(
            path, self.read_port_or("smoother_id", ""), self.max_smoothing_duration, self.check_for_collisions
        )
        return self.give(goal, SmoothedPath)

    def answered(self, answer: SmoothedPath) -> Status:
        """Write the path."""
        if not answer.error_code:
            write_if_connected(self, "smoothed_path", answer.path)
            write_if_connected(self, "smoothing_duration", answer.duration)
            write_if_connected(self, "was_completed", answer.was_completed)
        return self.ended(answer)


class ValidatePathLeaf(ServerCall):
    """Succeeds if the robot can still drive along a path; fails if not, and without a path.

    Nav2's input ``footprint`` takes the robot's own outline only: another one is refused.
    """

    service = "is_path_valid"

    checked = Input[Any](name="path", description="the path")
    max_cost = Input(int, default=254, description="the cost from which on a pose is invalid")
    consider_unknown_as_obstacle = Input(bool, default=False, description="whether unknown ground is an obstacle")
    layer_name = Input(str, default="", description="static for the map alone, empty for all that is known")
    footprint = Input(str, default="", description="empty: the robot's own outline")
    stop_at_first_collision = Input(bool, default=True, description="whether one invalid pose is enough to know")
    max_lookahead_distance = Input(float, default=-1.0, description="how far ahead to look, in metres; -1 is all")
    collision_poses = Output[Any](description="the poses that are invalid")

    def ask(self) -> Asked[Any]:
        """Call the service."""
        if self.footprint:
            raise ValueError("port 'footprint' must be empty: a path is checked for the robot's own outline")
        request = ValidatePath(
            path_at(self, "path"),
            self.max_cost,
            self.consider_unknown_as_obstacle,
            self.layer_name,
            self.stop_at_first_collision,
            self.max_lookahead_distance,
        )
        self._path = request.path
        return self.call(request, PathValidity)

    def answered(self, answer: PathValidity) -> Status:
        """Write the invalid poses."""
        invalid = [self._path.pose(index) for index in answer.invalid_pose_indices if index < len(self._path.poses)]
        write_if_connected(self, "collision_poses", invalid)
        if answer.success and answer.is_valid:
            return SUCCESS
        return self.failed("the path is not valid" if answer.success else "the path could not be checked")
