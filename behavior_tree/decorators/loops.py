"""Decorators that run the child several times."""

from typing import ClassVar

from ..nodes.decorator import Decorator
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, Status


class _Loop(Decorator):
    """Repeat and RetryUntilSuccessful, which differ in the result of the child that leads to another round.

    Attributes:
        again: The child's result that is counted and leads to the next round; the other one ends the loop.
        count_port: The input with the number of rounds, -1 for no end.
    """

    again: ClassVar[Status]
    count_port: ClassVar[str]

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._rounds = 0

    def tick(self) -> Status:
        """Tick the child; continue to the next round at once if the child was running before."""
        limit: int = self.read_port(self.count_port)
        self.set_running()
        while limit == -1 or self._rounds < limit:
            was_idle = self.child.status == IDLE
            status = self.child.execute_tick()
            if status == RUNNING:
                return RUNNING
            self.child.reset()
            if status == SKIPPED:
                return SKIPPED
            if status != self.again:
                self._rounds = 0
                return status
            self._rounds += 1
            limit = self._limit_after_round(limit)
            if was_idle and (limit == -1 or self._rounds < limit):
                self.request_wake_up()
                return RUNNING
        self._rounds = 0
        return self.again

    def halt(self) -> None:
        """Reset the child and begin to count again."""
        self._rounds = 0
        super().halt()

    def _limit_after_round(self, limit: int) -> int:
        return limit


class Repeat(_Loop):
    """Runs the child until it succeeded a number of times; fails with it."""

    again = SUCCESS
    count_port = "num_cycles"

    num_cycles = Input(int, description="how often; -1: for ever, 0: succeed without running the child")


class RetryUntilSuccessful(_Loop):
    """Runs the child until it succeeds; fails after a number of failures."""

    again = FAILURE
    count_port = "num_attempts"

    num_attempts = Input(int, description="how often; -1: for ever, 0: fail without running the child")

    def _limit_after_round(self, limit: int) -> int:
        # The failed child may have changed the number of attempts; BehaviorTree.CPP looks again here only.
        return self.num_attempts
