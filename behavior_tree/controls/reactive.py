"""Nodes that ask all their children again at every tick."""

from typing import ClassVar

from ..nodes.control_node import Control
from ..nodes.node import Node
from ..status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status


class _Reactive(Control):
    """ReactiveSequence and ReactiveFallback, which differ in the result that leads on to the next child."""

    passing: ClassVar[Status] = SUCCESS

    def tick(self) -> Status:
        """Tick children from the first."""
        self.set_running()
        all_skipped = True
        for child in self.children:
            status = child.execute_tick()
            if status == self.passing:
                all_skipped = False
            elif status == SKIPPED:
                child.reset()
            elif status == RUNNING:
                self._halt_others(child)
                return RUNNING
            else:
                self.reset_children()
                return status
        self.reset_children()
        return SKIPPED if all_skipped else self.passing

    def _halt_others(self, running: Node) -> None:
        for child in self.children:
            if child.status and child is not running:
                child.reset()


class ReactiveSequence(_Reactive):
    """Ticks all children in order until one fails or runs; halts the others while one runs."""


class ReactiveFallback(_Reactive):
    """Ticks all children in order until one succeeds or runs; halts the others while one runs."""

    passing: ClassVar[Status] = FAILURE
