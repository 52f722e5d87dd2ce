"""The leaves that change lists of goals."""

from __future__ import annotations

import math
from typing import Any

from behavior_tree import FAILURE, SUCCESS, Input, Node, Output, Status, SyncAction
from regraft.services.bt_executor.leaves.asking_leaf import require_ports, write_if_connected
from regraft.services.bt_executor.leaves.nav2.poses import goals_of, pose_at, pose_at_or_none, pose_of
from regraft.services.bt_executor.leaves.nav2.waypoints import marked


class RemovePassedGoals(SyncAction):
    """Takes the first goals out of a list while the robot is near them; the last one always stays.

    It fails while the robot's pose is unknown. It also fails where a goal is not among the waypoints that are given.
    """

    radius = Input(float, default=0.5, description="how near, in metres")
    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    input_goals = Input[Any](description="the list")
    output_goals = Output[Any](description="the list without them")
    input_waypoint_statuses = Input[Any](description="the statuses of all waypoints")
    output_waypoint_statuses = Output[Any](description="the same, with the goals passed marked as completed")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")

    def tick(self) -> Status:
        """Write the shorter list."""
        goals = goals_of(self.read_port_or("input_goals"))
        if not goals:
            write_if_connected(self, "output_goals", goals)
            return SUCCESS
        here = pose_at_or_none(self, "pose")
        if here is None:
            return FAILURE
        count = 0
        while count < len(goals) - 1 and _distance(goals[count], here) <= self.radius:
            count += 1
        statuses = self.read_port_or("input_waypoint_statuses")
        if statuses is not None:
            try:
                statuses = marked(statuses, goals[:count], "completed")
            except ValueError:
                return FAILURE
            write_if_connected(self, "output_waypoint_statuses", statuses)
        write_if_connected(self, "output_goals", goals[count:])
        return SUCCESS


class AppendGoalPoseToGoals(SyncAction):
    """Puts a goal at the end of a list."""

    goal_pose = Input[Any](description="the goal")
    input_goals = Input[Any](description="the list")
    output_goals = Output[Any](description="the longer list")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "goal_pose", "output_goals")

    def tick(self) -> Status:
        """Write the longer list."""
        pose_at(self, "goal_pose")
        self.output_goals = [*goals_of(self.read_port_or("input_goals")), self.goal_pose]
        return SUCCESS


class GetNextFewGoals(SyncAction):
    """Takes the first few goals of a list; fails if it is empty."""

    num_goals = Input(int, description="how many")
    input_goals = Input[Any](description="the list")
    output_goals = Output[Any](description="its first goals")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "num_goals", "output_goals")

    def tick(self) -> Status:
        """Write them."""
        goals = goals_of(self.read_port_or("input_goals"))
        if not goals:
            return FAILURE
        self.output_goals = goals[: max(0, self.num_goals)]
        return SUCCESS


def _distance(goal: Any, here: Any) -> float:
    there = pose_of(goal).pose
    return math.hypot(there.x - here.pose.x, there.y - here.pose.y)
