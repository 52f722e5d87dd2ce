"""The leaves for visiting places one after the other."""

from __future__ import annotations

from typing import Any

from behavior_tree import (
    FAILURE,
    RUNNING,
    SUCCESS,
    InOut,
    Input,
    Node,
    NodeSetup,
    Output,
    StatefulAction,
    Status,
    SyncAction,
)
from behavior_tree.nav2.goals import write_goal
from regraft.bus_schema.messages.maps import Goals
from regraft.services.bt_executor.leaves.asking_leaf import require_ports, write_if_connected
from regraft.services.bt_executor.leaves.context import LeafContext


class GetGoals(StatefulAction):
    """Waits until there are goals, then puts the newest list of them on the blackboard."""

    port_name = Input(str, name="input", default="goals", description="the executor's input that they come from")
    goals = Output[Any](description="the list, for NextGoal")
    count = Output(int, description="how many there are")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self._context = context

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "goals")
        if "input" not in self.setup.attributes or self.has_literal("input"):
            self._context.check_input(self.port_name)

    def on_start(self) -> Status:
        """Look for goals."""
        return self.on_running()

    def on_running(self) -> Status:
        """Look for goals."""
        message: Goals | None = self._context.latest(self.port_name)
        if message is None or not message.goals:
            return RUNNING
        self.goals = list(message.goals)
        write_if_connected(self, "count", len(message.goals))
        return SUCCESS


class NextGoal(SyncAction):
    """Goes to the next entry of a list of goals, and from the last to the first; fails if the list is empty.

    The entry of ``index`` keeps its place in the list. While that is empty or unset, the next goal is the first.
    """

    goals = Input[Any](description="the list")
    index = InOut(int, description="the place in the list of the goal that was given last, from 0")
    goal = Output[Any](description="the goal, for NavigateTo")
    goal_name = Output(str, description="its name; empty for a pose or numbers")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "goals", "index", "goal")

    def tick(self) -> Status:
        """Write the next goal."""
        goals = self.goals
        if not goals:
            return FAILURE
        index = (self.read_port_or("index", -1) + 1) % len(goals)
        self.index = index
        write_goal(self, "goal", goals[index])
        write_if_connected(self, "goal_name", _name(goals[index]))
        return SUCCESS


class TakeGoal(SyncAction):
    """Takes the first entry out of a list of goals; fails if the list is empty or unset."""

    goals = InOut[Any](description="the list, which gets shorter")
    goal = Output[Any](description="the goal, for NavigateTo")
    goal_name = Output(str, description="its name; empty for a pose or numbers")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "goals", "goal")

    def tick(self) -> Status:
        """Write the goal, and the rest of the list."""
        goals = self.read_port_or("goals", [])
        if not goals:
            return FAILURE
        self.goals = list(goals[1:])
        write_goal(self, "goal", goals[0])
        write_if_connected(self, "goal_name", _name(goals[0]))
        return SUCCESS


class PutGoal(SyncAction):
    """Puts a goal at the end of a list of goals, to come back to it; the list may be unset."""

    goals = InOut[Any](description="the list, which gets longer")
    goal = Input[Any](description="the goal, as NextGoal and TakeGoal give it")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "goals", "goal")

    def tick(self) -> Status:
        """Write the longer list."""
        self.goals = [*self.read_port_or("goals", []), self.goal]
        return SUCCESS


def _name(goal: Any) -> str:
    """Return a goal's name; poses and numbers have none."""
    return str(getattr(goal, "name", ""))
