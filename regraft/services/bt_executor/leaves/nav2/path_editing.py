"""The leaves that cut, join and look into paths."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from behavior_tree import FAILURE, SUCCESS, Input, Node, NodeSetup, Output, Status, SyncAction
from regraft.bus_schema.messages.nav2.paths import MAX_POSES, Path
from regraft.services.bt_executor.leaves.asking_leaf import require_ports, write_if_connected
from regraft.services.bt_executor.leaves.nav2.poses import path_at, pose_at_or_none


class TruncatePath(SyncAction):
    """Cuts off the end of a path, so that it ends so far from its goal; the last pose looks at the goal."""

    input_path = Input[Any](description="the path")
    distance = Input(float, default=1.0, description="as the crow flies, in metres")
    output_path = Output[Any](description="the shorter path")

    def tick(self) -> Status:
        """Write the shorter path."""
        path = path_at(self, "input_path")
        poses = path.rows
        if len(poses):
            far = np.hypot(*(poses[:, :2] - poses[-1, :2]).T) >= self.distance
            last = max(int(np.flatnonzero(far)[-1]) if far.any() else 0, min(1, len(poses) - 1))
            cut = poses[: last + 1].copy()
            way = poses[-1, :2] - cut[-1, :2]
            cut[-1, 2] = math.atan2(way[1], way[0])
            path = Path.of(path.stamp, path.frame, cut)
        write_if_connected(self, "output_path", path)
        return SUCCESS


class TruncatePathLocal(SyncAction):
    """Cuts a path down to what is near the robot along it; fails while the robot's pose is unknown."""

    input_path = Input[Any](description="the path")
    output_path = Output[Any](description="the shorter path")
    distance_forward = Input(float, default=8.0, description="how far ahead, in metres; -1 is to the end")
    distance_backward = Input(float, default=4.0, description="how far back, in metres")
    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    transform_tolerance = Input(float, default=0.2, description="for the pose's source, not used here")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")
    angular_distance_weight = Input(float, default=0.0, description="metres for each radian of another heading")
    max_robot_pose_search_dist = Input(
        float, default=math.inf, description="how far along the path from the last nearest pose to look, in metres"
    )

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._path = Path()
        self._first = 0

    def tick(self) -> Status:
        """Write the shorter path."""
        path, here = path_at(self, "input_path"), pose_at_or_none(self, "pose")
        if here is None:
            return FAILURE
        if not len(path.poses):
            write_if_connected(self, "output_path", path)
            return SUCCESS
        search = self.max_robot_pose_search_dist
        if not math.isfinite(search) or path != self._path:
            self._path, self._first = path, 0
        rows = path.rows
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(rows[:, :2], axis=0).T))])
        end = int(np.searchsorted(along, along[self._first] + search, side="right"))
        at = self._first + int(self._distances(rows[self._first : end], here.pose).argmin())
        self._first = at
        forward = self.distance_forward if self.distance_forward >= 0.0 else math.inf
        last = int(np.searchsorted(along, along[at] + forward, side="right"))
        first = int(np.searchsorted(along, along[at] - self.distance_backward, side="left"))
        write_if_connected(self, "output_path", replace(path, poses=path.poses[first:last]))
        return SUCCESS

    def _distances(self, poses: Any, here: Any) -> Any:
        turned = np.abs(np.remainder(poses[:, 2] - here.yaw + math.pi, math.tau) - math.pi)
        aside = self.angular_distance_weight * turned
        return np.hypot(np.hypot(poses[:, 0] - here.x, poses[:, 1] - here.y), aside)


class GetPoseFromPath(SyncAction):
    """Takes one pose of a path; fails if the path has no such index."""

    looked_into = Input[Any](name="path", description="the path")
    index = Input(int, default=0, description="0 for the first, -1 for the last")
    pose = Output[Any](description="the pose")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "pose")

    def tick(self) -> Status:
        """Write the pose."""
        path, index = path_at(self, "path"), self.index
        if not -len(path.poses) <= index < len(path.poses):
            return FAILURE
        self.pose = path.pose(index)
        return SUCCESS


class ConcatenatePaths(SyncAction):
    """Joins two paths; fails if both are empty, or too long for one path."""

    input_path1 = Input[Any](description="the first")
    input_path2 = Input[Any](description="the second")
    output_path = Output[Any](description="one behind the other")

    def tick(self) -> Status:
        """Write the longer path."""
        first, second = path_at(self, "input_path1"), path_at(self, "input_path2")
        if not 0 < len(first.poses) + len(second.poses) <= MAX_POSES:
            return FAILURE
        head = first if len(first.poses) else second
        write_if_connected(self, "output_path", replace(head, poses=first.poses + second.poses))
        return SUCCESS
