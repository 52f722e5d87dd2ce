"""A node that cleans up after a failure."""

from typing import ClassVar

from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, Status


class TryCatch(Control):
    """Ticks all children but the last in order; after a failure ticks the last to its end and fails."""

    min_children: ClassVar[int] = 2

    catch_on_halt = Input(bool, default=False, description="whether being halted ticks the last child once, too")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._index = 0
        self._skipped = 0
        self._catching = False

    def tick(self) -> Status:
        """Continue trying or catching."""
        if self.status == IDLE:
            self._skipped = 0
        self.set_running()
        if not self._catching:
            status = self._tick_tried()
            if status != FAILURE:
                return status
            self.reset_children()
            self._catching = True
        if self.children[-1].execute_tick() == RUNNING:
            return RUNNING
        self.reset_children()
        self._index = 0  # BehaviorTree.CPP counts skipped children on, unless the parent resets the node.
        self._catching = False
        return FAILURE

    def halt(self) -> None:
        """Reset all children; tick the last one once before, if asked to and not yet catching."""
        if self.status == RUNNING and not self._catching and self.read_port_or("catch_on_halt", False):
            self._catching = True  # Should the clean-up fail, a second halt must not begin it again.
            self.reset_children()
            self.children[-1].execute_tick()
        self._rewind()
        super().halt()

    def _tick_tried(self) -> Status:
        tried = len(self.children) - 1
        while self._index < tried:
            status = self.children[self._index].execute_tick()
            if status in (RUNNING, FAILURE):
                return status
            self._skipped += status == SKIPPED
            self._index += 1
        all_skipped = self._skipped == tried
        self.reset_children()
        self._rewind()
        return SKIPPED if all_skipped else SUCCESS

    def _rewind(self) -> None:
        self._index = 0
        self._skipped = 0
        self._catching = False
