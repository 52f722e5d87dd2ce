"""Nodes that tick their children one after the other and remember where they are."""

from typing import ClassVar

from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..status import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, Status


class _Ordered(Control):
    """Sequence and Fallback, which differ in the result that leads on to the next child.

    Attributes:
        passing: The child's result that leads on; the other one ends the node.
        yields: Whether the node returns RUNNING between two children of which the first completed at once.
    """

    passing: ClassVar[Status] = SUCCESS
    yields: ClassVar[bool] = False

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._index = 0
        self._skipped = 0

    def tick(self) -> Status:
        """Tick children from where the last tick stopped."""
        if self.status == IDLE:
            self._skipped = 0
        if self._observers:
            self.set_running()
        else:
            self.status = RUNNING  # what set_running would do, without the call
        children, passing, yields = self.children, self.passing, self.yields
        index = self._index
        while index < len(children):
            child = children[index]
            was_idle = yields and child.status == IDLE
            status = child.execute_tick()
            if status == passing:
                index += 1
                self._index = index
                if was_idle and index < len(children):
                    self.request_wake_up()
                    return RUNNING
            elif status == RUNNING:
                return RUNNING
            elif status == SKIPPED:
                index += 1
                self._index = index
                self._skipped += 1
            else:
                self._stop_early()
                return status
        all_skipped = self._skipped == len(children)
        self.reset_each(children)
        self._index = self._skipped = 0
        return SKIPPED if all_skipped else passing

    def halt(self) -> None:
        """Reset all children and begin with the first next time."""
        self._index = self._skipped = 0
        super().halt()

    def _stop_early(self) -> None:
        # BehaviorTree.CPP keeps the count of skipped children here, until the parent resets the node.
        self.reset_each(self.children)
        self._index = 0


class Sequence(_Ordered):
    """Ticks its children in order until one fails; succeeds after the last."""


class AsyncSequence(Sequence):
    """A Sequence that lets the rest of the tree react between two children."""

    yields: ClassVar[bool] = True


class Fallback(_Ordered):
    """Ticks its children in order until one succeeds; fails after the last."""

    passing: ClassVar[Status] = FAILURE


class AsyncFallback(Fallback):
    """A Fallback that lets the rest of the tree react between two children."""

    yields: ClassVar[bool] = True


class SequenceWithMemory(_Ordered):
    """A Sequence that, after a failure or a halt, continues with the child at which it stopped."""

    yields: ClassVar[bool] = True

    def halt(self) -> None:
        """Reset all children; the place is kept."""
        Control.halt(self)

    def _stop_early(self) -> None:
        for child in self.children[self._index :]:
            child.reset()
