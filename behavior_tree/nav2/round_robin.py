"""The node whose children take turns."""

from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status


class RoundRobin(Control):
    """Ticks its children in turn until one succeeds, and continues behind that one next time.

    Without wrap_around the round ends with the last child. As in Nav2 that comes before its result is looked at: the
    node fails even if the last child succeeds.
    """

    wrap_around = Input(bool, default=False, description="whether the first child follows the last")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._index = 0
        self._failures = 0

    def tick(self) -> Status:
        """Tick children from the one whose turn it is."""
        wraps = self.read_port_or("wrap_around", False)
        count = len(self.children)
        self.set_running()
        skipped = 0
        while self._failures + skipped < count:
            status = self.children[self._index].execute_tick()
            if status == RUNNING:
                return RUNNING
            self._index += 1
            is_last = self._index == count
            if is_last:
                self._index = 0
            if status == SUCCESS and (wraps or not is_last):
                self._failures = 0
                self.reset_children()
                return SUCCESS
            self._failures += status == FAILURE
            skipped += status == SKIPPED
            if is_last and not wraps:
                break
        self.halt()
        return SKIPPED if skipped == count else FAILURE

    def halt(self) -> None:
        """Reset all children and begin with the first next time."""
        self._index = 0
        self._failures = 0
        super().halt()
