"""The base of decorators: nodes with one child."""

from typing import ClassVar

from ..status import COMPLETED, Status
from .manifest import NodeKind
from .node import Node


class Decorator(Node):
    """A node that changes when its child is ticked, or what becomes of the result.

    A subclass implements `tick`, marks itself running there (`set_running`), and ticks `child` with
    ``self.child.execute_tick()``. A child that completed is reset after every tick of the decorator.

    Attributes:
        child: The child.
    """

    kind: ClassVar[NodeKind] = NodeKind.DECORATOR

    child: Node

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child; see `Node.adopt`."""
        if len(children) != 1:
            raise ValueError(f"{self.type_id} needs exactly 1 child, it has {len(children)}")
        super().adopt(children)
        self.child = children[0]

    def halt(self) -> None:
        """Reset the child and become idle."""
        self.child.reset()
        super().halt()

    def execute_tick(self) -> Status:
        """Tick the node; then reset the child if it completed. See `Node.execute_tick`."""
        status = Node.execute_tick(self)
        if self.child.status in COMPLETED:
            self.child.reset()
        return status
