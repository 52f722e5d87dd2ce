"""The base of leaves that ask somebody on the bus and run until the answer is there."""

from __future__ import annotations

from typing import Any, ClassVar, Final

from behavior_tree import FAILURE, RUNNING, Node, NodeSetup, Output, StatefulAction, Status
from regraft import CallFailed
from regraft.services.bt_executor.leaves.context import Asked, LeafContext

PATIENCES: Final = ("timeout", "accept_within", "server_timeout")
"""Ports of leaves that have a time to wait, as far as they are there."""
LONGEST: Final = 1e9
"""The longest of these."""


def write_if_connected(node: Node, port: str, value: object) -> None:
    """Write an output that the XML may leave open."""
    if port in node.setup.writers:
        node.write_port(port, value)


def require_ports(node: Node, *names: str) -> None:
    """Make sure that the XML gives ports; raises ValueError, to which the loader adds the place."""
    missing = [name for name in names if name not in node.setup.attributes]
    if missing:
        raise ValueError(f"{node.type_id} needs the port{'s' * (len(missing) > 1)} {', '.join(missing)}")


def require_within(node: Node, least: float, most: float, *names: str) -> None:
    """Make sure that numbers which the XML gives ports are within bounds; raises ValueError as `require_ports` does."""
    for name in filter(node.has_literal, names):
        value = node.read_port(name)
        if not least <= value <= most:
            raise ValueError(f"port '{name}' must be from {least:g} to {most:g}, is {value:g}")


class Asking(StatefulAction):
    """Asks when it starts, is RUNNING until there is an answer, and gives up when it is halted.

    No answer, or a refusal, is a FAILURE, with the reason at the port ``reason`` and in the executor's log.
    A subclass implements `ask` and `answered`, and `progress` if feedback matters.
    """

    required_ports: ClassVar[tuple[str, ...]] = ()

    reason = Output(str, description="why it failed")
    code = Output(str, description="the code of a refusal, such as busy; empty otherwise")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self.context = context
        self._asked: Asked[Any] | None = None
        self._feedback: Any = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, *self.required_ports)
        require_within(self, 0.0, LONGEST, *PATIENCES)

    def ask(self) -> Asked[Any]:
        """Send the request or goal."""
        raise NotImplementedError(f"{type(self).__name__} does not implement ask()")

    def progress(self, feedback: Any) -> None:
        """Take new feedback of a goal."""

    def answered(self, answer: Any) -> Status:
        """Take the answer; return SUCCESS or FAILURE."""
        raise NotImplementedError(f"{type(self).__name__} does not implement answered()")

    def failed(self, reason: str) -> Status:
        """Report why it failed; returns FAILURE."""
        write_if_connected(self, "reason", reason)
        self.context.kit.log.warning("%s failed: %s", self.path, reason)
        return FAILURE

    def unanswered(self, error: CallFailed) -> Status:
        """Report why there is no answer; returns FAILURE."""
        write_if_connected(self, "code", error.code.value if error.code is not None else "")
        return self.failed(str(error))

    def on_start(self) -> Status:
        """Ask."""
        self._feedback = None
        write_if_connected(self, "reason", "")
        write_if_connected(self, "code", "")
        self._asked = self.ask()
        return RUNNING

    def on_running(self) -> Status:
        """Look whether there is an answer."""
        asked = self._asked
        assert asked is not None
        if asked.feedback is not self._feedback:
            self._feedback = asked.feedback
            self.progress(self._feedback)
        if not asked.done:
            return RUNNING
        self._asked = None
        if asked.error is not None:
            return self.unanswered(asked.error)
        return self.answered(asked.answer)

    def on_halted(self) -> None:
        """Give up; a goal is cancelled."""
        write_if_connected(self, "reason", "it was halted before it was done")
        if self._asked is not None:
            self._asked.give_up()
            self._asked = None
