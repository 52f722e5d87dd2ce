"""Decorators that run the child when a blackboard entry has changed."""

from typing import Any, ClassVar

from ..nodes.decorator import Decorator
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..nodes.updates import EntryWatch
from ..status import RUNNING, SKIPPED, Status


class SkipUnlessUpdated(Decorator):
    """Runs the child if an entry was written since the last look, else is skipped."""

    otherwise: ClassVar[Status] = SKIPPED

    entry = Input[Any](description="the blackboard entry to watch")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._watch = EntryWatch(self)
        self._child_runs = False

    def tick(self) -> Status:
        """Continue with a running child without looking; else look and, after a write, tick the child."""
        if not self._child_runs and not self._watch.was_written():
            return self.otherwise
        status = self.child.execute_tick()
        # Not the child's stored status: a control node whose children were all skipped is stored as running.
        self._child_runs = status == RUNNING
        return status

    def halt(self) -> None:
        """Reset the child and look again next time."""
        self._child_runs = False
        super().halt()


class WaitValueUpdate(SkipUnlessUpdated):
    """Runs the child if an entry was written since the last look, else waits."""

    otherwise: ClassVar[Status] = RUNNING
