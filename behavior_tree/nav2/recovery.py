"""The node that tries again after a recovery."""

from typing import ClassVar

from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, RUNNING, SKIPPED, Status


class RecoveryNode(Control):
    """Ticks the first child; each time it fails, ticks the second and, if that succeeds, tries the first again."""

    min_children: ClassVar[int] = 2
    max_children: ClassVar[int | None] = 2

    number_of_retries = Input(int, default=1, description="how often the first child is tried again")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._recovering = False
        self._retries = 0

    def tick(self) -> Status:
        """Continue trying or recovering, and from one to the other within the tick."""
        limit: int = self.read_port_or("number_of_retries", 1)
        self.set_running()
        while self._retries <= limit:
            ended = self._recover() if self._recovering else self._try(limit)
            if ended is not None:
                return ended
        self.halt()
        return FAILURE

    def halt(self) -> None:
        """Reset both children and begin to count again."""
        self._recovering = False
        self._retries = 0
        super().halt()

    def _try(self, limit: int) -> Status | None:
        """Tick the first child; None means that the second is next."""
        status = self.children[0].execute_tick()
        if status == RUNNING:
            return RUNNING
        if status == FAILURE and self._retries < limit:
            self.children[0].reset()
            self._recovering = True
            return None
        self.halt()
        return status

    def _recover(self) -> Status | None:
        """Tick the second child; None means that the first is next."""
        status = self.children[1].execute_tick()
        if status == RUNNING:
            return RUNNING
        if status == FAILURE:
            self.halt()
            return FAILURE
        self._recovering = False
        self.children[1].reset()
        if status == SKIPPED:
            return FAILURE  # No recovery is possible; as in Nav2, the retries so far stay counted.
        self._retries += 1
        return None
