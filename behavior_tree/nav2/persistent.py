"""A sequence that keeps its place on the blackboard."""

from ..nodes.control_node import Control
from ..nodes.node import Node
from ..nodes.ports import InOut
from ..status import FAILURE, RUNNING, SUCCESS, Status


class PersistentSequence(Control):
    """A Sequence whose place is a blackboard entry and outlives a halt; a skipped child counts as done."""

    current_child_idx = InOut(int, description="the child whose turn it is, counted from 0")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the children and check that there is an entry for the place."""
        super().adopt(children)
        if "current_child_idx" not in self.setup.writers:
            raise ValueError("current_child_idx needs a blackboard key, as in current_child_idx='{place}'")

    def tick(self) -> Status:
        """Tick children from the place on."""
        index: int = self.read_port_or("current_child_idx", 0)
        if index < 0:
            raise ValueError(f"current_child_idx is {index}; children are counted from 0")
        self.set_running()
        while index < len(self.children):
            status = self.children[index].execute_tick()
            if status == RUNNING:
                return RUNNING
            if status == FAILURE:
                return self._ended(FAILURE)
            index += 1
            self.current_child_idx = index
        return self._ended(SUCCESS)

    def _ended(self, status: Status) -> Status:
        self.reset_children()
        self.current_child_idx = 0
        return status
