"""The leaf that has the controller server follow a path."""

from __future__ import annotations

from typing import Any

from behavior_tree import RUNNING, Input, NodeSetup, Output, Status
from regraft.bus_schema.messages.nav2.paths import FollowError, FollowPath, Path, PathFollowed, TrackingFeedback
from regraft.services.bt_executor.leaves.asking_leaf import write_if_connected
from regraft.services.bt_executor.leaves.context import Asked, LeafContext
from regraft.services.bt_executor.leaves.nav2.poses import path_at
from regraft.services.bt_executor.leaves.nav2.server_leaf import ServerAction


class FollowPathLeaf(ServerAction):
    """Has the robot drive along a path; another path or another choice under way replaces the goal without a stop."""

    server = "follow_path"
    unknown = int(FollowError.UNKNOWN)
    required_ports = ("path",)

    followed = Input[Any](name="path", description="the path")
    controller_id = Input(str, default="", description="the controller, such as FollowPath")
    goal_checker_id = Input(str, default="", description="the goal checker, such as general_goal_checker")
    progress_checker_id = Input(str, default="", description="the progress checker, such as progress_checker")
    path_handler_id = Input(str, default="", description="the path handler, such as PathHandler")
    tracking_feedback = Output[Any](description="how well the path is followed")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup, context)
        self._given = FollowPath(Path())

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        self._given = self._wanted()
        return self.give(self._given, PathFollowed, TrackingFeedback)

    def on_running(self) -> Status:
        """Look whether the goal has ended; replace it where path or choices have changed meanwhile."""
        asked, wanted = self._asked, self._wanted()
        if asked is None or asked.done or not len(wanted.path.poses) or wanted == self._given:
            return super().on_running()
        asked.forget()
        self._asked, self._feedback = self.ask(), None
        return RUNNING

    def progress(self, feedback: TrackingFeedback) -> None:
        """Write how well the path is followed."""
        write_if_connected(self, "tracking_feedback", feedback)

    def answered(self, answer: PathFollowed) -> Status:
        """Succeed if the robot is at the path's end."""
        write_if_connected(self, "tracking_feedback", TrackingFeedback())
        return self.ended(answer)

    def _wanted(self) -> FollowPath:
        return FollowPath(
            path_at(self, "path"),
            self.read_port_or("controller_id", ""),
            self.read_port_or("goal_checker_id", ""),
            self.read_port_or("progress_checker_id", ""),
            self.read_port_or("path_handler_id", ""),
        )
