"""The leaf that drives somewhere."""

from __future__ import annotations

from typing import Any, Final

from behavior_tree import SUCCESS, Input, Node, Output, Status
from regraft.bus_schema.messages.geometry import FramedPose, Pose
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.services.bt_executor.leaves.asking_leaf import Asking, require_within, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.nav2.poses import pose_at

FARTHEST: Final = 1e9
"""Metres, or radians."""


class NavigateToGoal(Asking):
    """Drives to a pose; succeeds on arrival, fails if the robot ends up elsewhere or nobody drives it."""

    goal = Input[Any](description="where to: a goal of GetGoals, a pose, or numbers; else x, y and yaw")
    x = Input(float, description="metres")
    y = Input(float, description="metres")
    yaw = Input(float, default=0.0, description="radians")
    frame = Input(str, default="map", description="the frame of x, y and yaw")
    action = Input(str, default="navigate_to", description="the action that drives")
    accept_within = Input(float, default=5.0, description="seconds in which the goal must be accepted")
    distance_left = Output(float, description="metres along the path")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Refuse a leaf that is given no place, or two."""
        super().adopt(children)
        given = self.setup.attributes.keys() & {"goal", "x", "y"}
        if given not in ({"goal"}, {"x", "y"}):
            raise ValueError(f"{self.type_id} needs either the port goal, or the ports x and y")
        require_within(self, -FARTHEST, FARTHEST, "x", "y", "yaw")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        return self.context.goal(
            self.action,
            NavigateTo(self._where()),
            Arrival,
            NavigationProgress,
            accept_within=self.accept_within,
        )

    def _where(self) -> FramedPose:
        if "goal" not in self.setup.attributes:
            return FramedPose(self.frame, Pose.planar(self.x, self.y, self.yaw))
        return pose_at(self, "goal")

    def progress(self, feedback: NavigationProgress) -> None:
        """Report how far it still is."""
        write_if_connected(self, "distance_left", feedback.distance_left)

    def answered(self, answer: Arrival) -> Status:
        """Succeed if the robot is there."""
        if not answer.arrived:
            return self.failed(answer.reason or "did not arrive")
        write_if_connected(self, "distance_left", 0.0)
        return SUCCESS
