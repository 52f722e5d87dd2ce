"""Nav2's servers on a rig, with a small exact robot around them, and missions that drive it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from regraft.bus_schema.messages.geometry import FramedPose, Pose
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    Command,
    MissionCommand,
    MissionState,
    MissionStatus,
    WriteBlackboard,
)
from regraft.bus_schema.messages.nav2.paths import ComputedPath, ComputePathToPose
from regraft.component.component import Component
from regraft.component.goal import Goal
from regraft.planar import Pose2D
from regraft.services.bt_executor.navigation.navigation_executor import NavigationExecutor
from regraft.services.navigator.servers.controller_server import ControllerServer
from regraft.services.navigator.servers.planner_server import PlannerServer
from regraft.testing import Rig

from ..executor.helpers import entry, status
from ..navigator.stage import ROOM, TICK, Stage, room_map
from ..navigator.world import Box

TREES = Path(__file__).with_name("trees")
START = Pose2D(0.6, 2.0, 0.0)
GOAL = (3.4, 2.0, 0.0)
NEAR = 0.16
"""m: the controller's tolerance, and what the robot moves in a tick."""

A = TypeVar("A")


def framed(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> FramedPose:
    """Return a pose in the map."""
    return FramedPose(frame, Pose.planar(x, y, yaw))


@dataclass
class Bench:
    """The servers, the robot, and time."""

    rig: Rig
    stage: Stage

    @classmethod
    def of(cls, rig: Rig, start: Pose2D = START, boxes: list[Box] | None = None, **parameters: Any) -> Bench:
        """Put a robot into a room of which the map is known; ``parameters`` are the controller server's."""
        stage = Stage.of(rig, ControllerServer, start, boxes, parameters)
        bench = cls(rig, stage)
        rig.add(PlannerServer, "planner")
        stage.show_map(room_map(stage.robot.boxes))
        stage.run(0.5)
        return bench

    def surprise(self, *boxes: Box) -> None:
        """Put boxes into the room that the map lacks."""
        self.stage.robot.boxes = [*self.stage.robot.boxes, *boxes]

    def clear_away(self) -> None:
        """Take everything out of the room that the map lacks."""
        self.stage.robot.boxes = list(ROOM)

    def ask(self, action: str, goal: object, result: type[A], feedback: type[Any] | None = None) -> Goal[A, Any]:
        """Give an action a goal."""
        return self.rig.goal(action, goal, result, feedback)

    def finish(self, goal: Goal[A, Any], within: float = 60.0) -> A:
        """Let time pass until a goal has ended; returns its result."""
        self.run_until(lambda: goal.done, within)
        assert goal.result is not None, goal.error or "it does not end"
        return goal.result

    def do(self, action: str, goal: object, result: type[A], within: float = 60.0) -> A:
        """Give an action a goal, and let time pass until it has ended."""
        return self.finish(self.ask(action, goal, result), within)

    def plan(self, x: float, y: float, yaw: float = 0.0, **more: Any) -> ComputedPath:
        """Have a path to a pose computed."""
        return self.do("compute_path_to_pose", replace(ComputePathToPose(framed(x, y, yaw)), **more), ComputedPath)

    def run(self, seconds: float) -> None:
        """Let time pass."""
        self.stage.run(seconds)

    def run_until(self, holds: Callable[[], bool], within: float = 60.0) -> bool:
        """Let time pass until something holds, or no longer than ``within`` (s); return whether it does."""
        for _ in range(math.ceil(within / TICK)):
            if holds():
                return True
            self.stage.run(TICK)
        return holds()

    # --- missions ---

    def mission(self, xml: str, main: str = "", **entries: Any) -> None:
        """Start a mission with entries on its blackboard."""
        if "bt_executor" not in self.rig.runtimes:
            self.rig.add(NavigationExecutor, "bt_executor", {"autostart": False})
        self.run(0.2)
        self.rig.call("mission/command", MissionCommand(Command.LOAD, xml, main), MissionStatus)
        self.write(**entries)
        self.rig.call("mission/command", MissionCommand(Command.START), MissionStatus)

    def tree(self, name: str, **entries: Any) -> None:
        """Start one of Nav2's trees."""
        self.mission((TREES / f"{name}.xml").read_text(), **entries)

    def write(self, **entries: Any) -> None:
        """Write entries of the mission's blackboard."""
        if entries:
            self.rig.call("mission/write", WriteBlackboard(entries), BlackboardEntries)

    def value(self, key: str) -> Any:
        """Return the value of an entry."""
        return entry(self.rig, key).value

    def state(self) -> MissionState:
        """Return the mission's state."""
        return status(self.rig).state

    def ended(self, within: float = 120.0) -> MissionState:
        """Let time pass until the mission has ended; returns how."""
        self.run_until(lambda: self.state() is not MissionState.RUNNING, within)
        return self.state()

    def ticked(self, name: str) -> bool:
        """Return whether a node of that name or type is running."""
        return any(name in node.path and node.status.value == "running" for node in status(self.rig).nodes)

    def is_at(self, x: float, y: float, within: float = NEAR) -> bool:
        """Return whether the robot is near a place."""
        return math.dist(self.stage.robot.pose.position, (x, y)) <= within

    @property
    def pose(self) -> Pose2D:
        """Where the robot is."""
        return self.stage.robot.pose

    @property
    def collisions(self) -> int:
        """How often the robot touched something."""
        return len(self.stage.robot.collisions)


def add(rig: Rig, cls: type[Component], name: str, **parameters: Any) -> None:
    """Start another component."""
    rig.add(cls, name, parameters)
