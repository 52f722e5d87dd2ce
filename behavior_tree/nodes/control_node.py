"""The base of control nodes: nodes with any number of children."""

from typing import ClassVar

from .manifest import NodeKind
from .node import Node


class Control(Node):
    """A node that decides which of its children to tick.

    A subclass implements `tick`, marks itself running there (`set_running`), and resets its children before
    it completes. It overrides `halt` if it has a state of its own.

    Attributes:
        min_children: The fewest children that make sense.
        max_children: The most, None for any number.
    """

    kind: ClassVar[NodeKind] = NodeKind.CONTROL
    min_children: ClassVar[int] = 1
    max_children: ClassVar[int | None] = None

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the children; see `Node.adopt`."""
        if not children:
            raise ValueError(f"{self.type_id} needs at least {self.min_children} child nodes, it has none")
        if len(children) < self.min_children:
            raise ValueError(f"{self.type_id} needs at least {self.min_children} children, it has {len(children)}")
        if self.max_children is not None and len(children) > self.max_children:
            raise ValueError(f"{self.type_id} takes at most {self.max_children} children, it has {len(children)}")
        super().adopt(children)

    def halt(self) -> None:
        """Reset all children and become idle."""
        self.reset_children()
        super().halt()

    def reset_children(self) -> None:
        """Make every child idle, halting those that are running."""
        self.reset_each(self.children)
