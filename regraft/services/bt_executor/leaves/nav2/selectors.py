"""The leaves that choose planners, controllers and checkers by a topic, as an operator may set it."""

from __future__ import annotations

from typing import Any, ClassVar

from behavior_tree import FAILURE, SUCCESS, Input, Node, NodeSetup, Output, Status, SyncAction
from regraft.bus_schema.messages.nav2.motions import Selection
from regraft.services.bt_executor.leaves.asking_leaf import write_if_connected
from regraft.services.bt_executor.leaves.context import LeafContext, NoSuchInput


class _Selector(SyncAction):
    """Writes the name that the topic has brought last, else the default; fails if there is neither.

    ``topic_name`` is an input of the executor. An executor that has no such input keeps to the default.

    Attributes:
        subject: The kind of thing to choose; ports are named after it.
    """

    subject: ClassVar[str]

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self._context = context
        self._selected = ""

    def tick(self) -> Status:
        """Write the name."""
        try:
            message = self._context.latest(self.read_port("topic_name"))
        except NoSuchInput:
            message = None
        if isinstance(message, Selection) and message.name:
            self._selected = message.name
        self._selected = self._selected or self.read_port_or(f"default_{self.subject}", "")
        if not self._selected:
            return FAILURE
        write_if_connected(self, f"selected_{self.subject}", self._selected)
        return SUCCESS


def _selector(name: str, subject: str) -> type[Node]:
    """Return the selector of a subject, with ports named after it."""
    ports: dict[str, Any] = {
        "topic_name": Input(str, default=f"{subject}_selector", description="the executor's input that chooses"),
        f"default_{subject}": Input(str, description="the name until the topic has brought one"),
        f"selected_{subject}": Output(str, description="the name"),
    }
    body = {"__doc__": f"Chooses a {subject.replace('_', ' ')}.", "__module__": __name__, "subject": subject}
    return type(name, (_Selector,), body | ports)


ControllerSelector = _selector("ControllerSelector", "controller")
PlannerSelector = _selector("PlannerSelector", "planner")
GoalCheckerSelector = _selector("GoalCheckerSelector", "goal_checker")
ProgressCheckerSelector = _selector("ProgressCheckerSelector", "progress_checker")
PathHandlerSelector = _selector("PathHandlerSelector", "path_handler")
SmootherSelector = _selector("SmootherSelector", "smoother")
