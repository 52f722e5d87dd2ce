"""Conditions about goals."""

import math
from typing import Any

from ...nodes.leaf import Condition
from ...nodes.node import Node, NodeSetup
from ...nodes.ports import Input
from ...status import IDLE
from ..geometry import position_of, same


class GoalReached(Condition):
    """Holds while the robot is near a goal. Nav2 has the distance as a parameter, here it is a port."""

    goal = Input[Any](description="the place to check")
    robot_base_frame = Input(str, default="", description="for the pose's source, not used here")
    goal_reached_tol = Input(float, default=0.25, description="how near is there, in metres")
    pose = Input[Any](default="{@robot_pose}", description="where the robot is")

    def holds(self) -> bool:
        """Return whether the robot is there; not while its pose is unknown."""
        here = self.read_port_or("pose")
        return here is not None and math.dist(position_of(self.goal), position_of(here)) <= self.goal_reached_tol


class _GoalWatch(Condition):
    """The base of conditions that compare the goals with those of the last time."""

    goal = Input[Any](default="{goal}", description="the goal")
    goals = Input[Any](default="{goals}", description="the goals")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._known: tuple[Any, Any] = (None, None)

    def note(self) -> bool:
        """Remember the goals; return whether they are others than before."""
        before, self._known = self._known, (_value(self, "goal"), _value(self, "goals"))
        return not all(map(same, before, self._known))


class GoalUpdated(_GoalWatch):
    """Holds once after each change of the goals, from the first tick after a start on."""

    def holds(self) -> bool:
        """Return whether the goals have changed since the last tick; not at the start."""
        starts = self.status == IDLE
        return self.note() and not starts


class GlobalUpdatedGoal(_GoalWatch):
    """Holds at its first tick of all and once after each change of the goals, also while it was reset."""

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._is_first = True

    def holds(self) -> bool:
        """Return whether the goals have changed since the last tick."""
        is_first, self._is_first = self._is_first, False
        return self.note() or is_first


class InitialPoseReceived(Condition):
    """Holds when somebody has stated where the robot is."""

    initial_pose_received = Input(bool, default="{@initial_pose_received}", description="whether that is so")

    def holds(self) -> bool:
        """Return the input; False while it is unset."""
        return bool(self.read_port_or("initial_pose_received", False))


def _value(node: Node, port: str) -> Any:
    return node.read_port_or(port)
