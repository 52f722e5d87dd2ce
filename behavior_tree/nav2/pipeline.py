"""Control nodes that keep several children going at once."""

from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status


class PipelineSequence(Control):
    """Ticks its children in order, those before the running one again and again.

    A running child ends the tick if none behind it ran before; an earlier one is passed over.
    """

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._furthest = 0

    def tick(self) -> Status:
        """Tick the children from the first up to the running one."""
        skipped = 0
        for index, child in enumerate(self.children):
            status = child.execute_tick()
            if status == FAILURE:
                self._rewind()
                return FAILURE
            if status == RUNNING and index >= self._furthest:
                self._furthest = index
                return RUNNING
            skipped += status == SKIPPED
        self._rewind()
        return SKIPPED if skipped == len(self.children) else SUCCESS

    def halt(self) -> None:
        """Reset all children and begin with the first next time."""
        self._furthest = 0
        super().halt()

    def _rewind(self) -> None:
        self.reset_children()
        self._furthest = 0


class NonblockingSequence(Control):
    """Ticks all its children at every tick; fails with the first that fails, succeeds when all do."""

    def tick(self) -> Status:
        """Tick every child."""
        all_succeeded = True
        for child in self.children:
            status = child.execute_tick()
            if status == FAILURE:
                self.reset_children()
                return FAILURE
            if status == SKIPPED:
                raise ValueError(f"its child '{child.path}' was skipped, which {self.type_id} does not allow")
            all_succeeded = all_succeeded and status == SUCCESS
        if not all_succeeded:
            return RUNNING
        self.reset_children()
        return SUCCESS
