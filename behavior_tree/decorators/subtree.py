"""The decorator that represents another tree."""

from typing import ClassVar

from ..nodes.decorator import Decorator
from ..nodes.manifest import NodeKind
from ..status import COMPLETED, Status


class SubTree(Decorator):
    """Ticks the root of another tree, whose nodes have a blackboard of their own, and passes its result on.

    The loader evaluates the attributes. ``ID`` is the tree, and ``_autoremap`` shares keys of the same name. Every
    other attribute connects a key of the sub-tree to one of this tree (``a="{b}"``) or sets it (``a="3"``).
    """

    kind: ClassVar[NodeKind] = NodeKind.SUBTREE

    def tick(self) -> Status:
        """Tick the root of the sub-tree."""
        self.set_running()
        status = self.child.execute_tick()
        if status in COMPLETED:
            self.child.reset()
        return status
