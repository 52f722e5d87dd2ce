"""The base classes of the nodes that do the work: actions and conditions."""

from typing import ClassVar

from ..status import COMPLETED, FAILURE, IDLE, RUNNING, SUCCESS, Status
from .manifest import NodeKind
from .node import Node


class Leaf(Node):
    """A node without children; subclass one of the three below instead."""

    kind: ClassVar[NodeKind] = NodeKind.ACTION

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Refuse children; see `Node.adopt`."""
        if children:
            raise ValueError(f"{self.type_id} is a leaf and takes no children, it has {len(children)}")


class SyncAction(Leaf):
    """An action that is done within one tick; `tick` must not return RUNNING."""

    results: ClassVar[tuple[Status, ...]] = COMPLETED

    def _wrong_result(self, status: Status) -> Exception:
        if status == RUNNING:
            return ValueError("it is a synchronous action and must not return RUNNING")
        return super()._wrong_result(status)


class StatefulAction(Leaf):
    """An action that takes more than one tick.

    Once it completed it keeps its result and is not asked again until its parent resets it.
    """

    def on_start(self) -> Status:
        """Begin; return RUNNING, or the result if there is nothing to wait for."""
        raise NotImplementedError(f"{type(self).__name__} does not implement on_start()")

    def on_running(self) -> Status:
        """Continue; called at every tick after the one that began, until the action completes or is halted."""
        raise NotImplementedError(f"{type(self).__name__} does not implement on_running()")

    def on_halted(self) -> None:
        """Give up; called only while the action is running."""

    def tick(self) -> Status:
        """Begin, continue, or repeat the result."""
        if self.status == RUNNING:
            return self.on_running()
        return self.on_start() if self.status == IDLE else self.status

    def halt(self) -> None:
        """Give up if running; become idle, even if giving up fails."""
        try:
            if self.status == RUNNING:
                self.on_halted()
        finally:
            super().halt()


class Condition(Leaf):
    """A question about the world, asked again at every tick; override `holds`, or `tick` for other results."""

    kind: ClassVar[NodeKind] = NodeKind.CONDITION

    def holds(self) -> bool:
        """Return whether the condition holds."""
        raise NotImplementedError(f"{type(self).__name__} implements neither holds() nor tick()")

    def tick(self) -> Status:
        """Return SUCCESS if the condition holds, else FAILURE."""
        return SUCCESS if self.holds() else FAILURE
