"""The leaves that leave a whole drive to a navigator with a tree of its own."""

from __future__ import annotations

from typing import Any

from behavior_tree import Input, Status
from regraft.bus_schema.messages.nav2.navigate import (
    Navigated,
    NavigateThroughPoses,
    NavigateToPose,
    NavigationFeedback,
)
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.nav2.poses import goals_of, pose_at, pose_of
from regraft.services.bt_executor.leaves.nav2.server_leaf import ServerAction


class NavigateToPoseLeaf(ServerAction):
    """Has a navigator drive to a goal by a behaviour tree."""

    server, unknown = "navigate_to_pose", 9000
    required_ports = ("goal",)

    goal = Input[Any](description="where to")
    behavior_tree = Input(str, default="", description="the file of the tree; by default the navigator's own")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        goal = NavigateToPose(pose_at(self, "goal"), self.behavior_tree)
        return self.give(goal, Navigated, NavigationFeedback)

    def answered(self, answer: Navigated) -> Status:
        """Succeed if the robot is there."""
        return self.ended(answer)


class NavigateThroughPosesLeaf(ServerAction):
    """Has a navigator drive through goals by a behaviour tree."""

    server, unknown = "navigate_through_poses", 9100
    required_ports = ("goals",)

    goals = Input[Any](description="through where: a list of goals")
    behavior_tree = Input(str, default="", description="the file of the tree; by default the navigator's own")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        goals = tuple(map(pose_of, goals_of(self.read_port_or("goals"))))
        return self.give(NavigateThroughPoses(goals, self.behavior_tree), Navigated, NavigationFeedback)

    def answered(self, answer: Navigated) -> Status:
        """Succeed if the robot was at all of them."""
        return self.ended(answer)
