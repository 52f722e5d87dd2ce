"""Decorators that look at goals."""

from typing import Any

from ..nodes.decorator import Decorator
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import Input, Output
from ..nodes.text import board_key
from ..status import IDLE, RUNNING, Status
from .geometry import poses_of, same, stamp_of


class GoalUpdatedController(Decorator):
    """Lets the child start again only when the goal or the goals have changed; is running meanwhile."""

    goal = Input[Any](default="{goal}", description="the goal")
    goals = Input[Any](default="{goals}", description="the goals")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._goals: tuple[Any, Any] = (None, None)
        self._is_new = True

    def tick(self) -> Status:
        """Tick the child at the start, while it is running, and after a change."""
        goals = self.read_port_or("goal"), self.read_port_or("goals")
        if self.status == IDLE or not all(map(same, goals, self._goals)):
            self._goals = goals
            self._is_new = True
        self.set_running()
        if not self._is_new and self.child.status != RUNNING:
            return RUNNING
        self._is_new = False
        return self.child.execute_tick()


class GoalUpdater(Decorator):
    """Ticks the child after passing the newest goal on: the one received, unless it is older than the given one.

    A received goal without a stamp is ignored.
    """

    input_goal = Input[Any](description="the goal as given")
    input_goals = Input[Any](description="the goals as given")
    output_goal = Output[Any](description="the newest goal")
    output_goals = Output[Any](description="the newest goals")
    received_goal = Input[Any](default="{@goal_update}", description="the goal last received")
    received_goals = Input[Any](default="{@goals_update}", description="the goals last received")

    def tick(self) -> Status:
        """Pass goal and goals on and tick the child."""
        given, received = self.read_port_or("input_goal"), self.read_port_or("received_goal")
        write_goal(self, "output_goal", _newest(given, stamp_of(given), received))
        several = self.read_port_or("input_goals")
        latest = max((stamp_of(goal) for goal in _members(several)), default=0.0)
        write_goal(self, "output_goals", _newest(several, latest, self._received_goals()))
        return self.child.execute_tick()

    def _received_goals(self) -> Any:
        received = self.read_port_or("received_goals")
        return received if len(_members(received)) else None


def _newest(given: Any, stamp: float, received: Any) -> Any:
    if received is None:
        return given
    when = stamp_of(received) or max((stamp_of(goal) for goal in _members(received)), default=0.0)
    return received if when and when >= stamp else given


def _members(goals: Any) -> Any:
    """Return the goals one by one; a single goal has none."""
    if isinstance(goals, list | tuple):
        return goals
    inner = goals.get("goals") if isinstance(goals, dict) else getattr(goals, "goals", None)
    if inner is not None:
        return inner
    try:
        return poses_of(goals)
    except ValueError:
        return ()


def write_goal(node: Node, port: str, value: Any) -> None:
    """Write an output if it is connected; a goal may be of another type than the one that its entry holds."""
    if value is None or port not in node.setup.writers:
        return
    key = board_key(node.setup.attributes[port], port)
    entry = node.blackboard.find(key) if key else None
    if entry is not None and entry.value is not None and not isinstance(value, type(entry.value)):
        entry.type = None
    node.write_port(port, value)
