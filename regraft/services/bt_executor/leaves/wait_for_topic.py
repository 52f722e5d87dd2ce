"""The leaf that waits for a message."""

from __future__ import annotations

from typing import Any

from behavior_tree import RUNNING, SUCCESS, Input, Node, NodeSetup, Output, StatefulAction, Status
from regraft.services.bt_executor.leaves.asking_leaf import require_ports, write_if_connected
from regraft.services.bt_executor.leaves.context import LeafContext


class WaitForTopic(StatefulAction):
    """Runs until one of the executor's inputs has a message, or with ``fresh`` a new one."""

    port_name = Input(str, name="input", description="the executor's input")
    fresh = Input(bool, default=False, description="whether only a message that came after the start counts")
    message = Output[Any](description="the message")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup)
        self._context = context
        self._stale: Any = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "input")
        if self.has_literal("input"):
            self._context.check_input(self.port_name)

    def on_start(self) -> Status:
        """Note what is there already."""
        self._stale = self._context.latest(self.port_name) if self.fresh else None
        return self.on_running()

    def on_running(self) -> Status:
        """Look for a message."""
        message = self._context.latest(self.port_name)
        if message is None or message is self._stale:
            return RUNNING
        self._stale = None
        write_if_connected(self, "message", message)
        return SUCCESS
