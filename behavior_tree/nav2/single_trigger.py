"""The decorator that runs the child once for each start."""

from ..nodes.decorator import Decorator
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import COMPLETED, FAILURE, IDLE, Status


class SingleTrigger(Decorator):
    """Runs the child to its end once after each start, then fails.

    With is_global it is armed only by a new value of the blackboard entry ``run_id``.
    """

    is_global = Input(bool, default=False, description="once for each run_id, not for each start")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._is_armed = True
        self._run_id: object = None

    def tick(self) -> Status:
        """Tick the child if armed."""
        if self.is_global:
            run_id = self.blackboard.get("run_id")
            if run_id != self._run_id:
                self._run_id = run_id
                self._is_armed = True
        elif self.status == IDLE:
            self._is_armed = True
        self.set_running()
        if not self._is_armed:
            return FAILURE
        status = self.child.execute_tick()
        if status in COMPLETED:
            self._is_armed = False
        return status
