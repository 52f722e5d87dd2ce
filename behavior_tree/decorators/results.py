"""Decorators that change what becomes of the child's result."""

from typing import ClassVar

from ..nodes.decorator import Decorator
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import COMPLETED, FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, Status


class _Mapping(Decorator):
    """Replaces SUCCESS and FAILURE of the child, passes RUNNING and SKIPPED on."""

    on_success: ClassVar[Status]
    on_failure: ClassVar[Status]

    def tick(self) -> Status:
        """Tick the child and map its result."""
        self.set_running()
        status = self.child.execute_tick()
        if status == SUCCESS:
            self.child.reset()
            return self.on_success
        if status == FAILURE:
            self.child.reset()
            return self.on_failure
        return status


class Inverter(_Mapping):
    """Succeeds when the child fails, and the other way round."""

    on_success = FAILURE
    on_failure = SUCCESS


class ForceSuccess(_Mapping):
    """Succeeds when the child completes."""

    on_success = SUCCESS
    on_failure = SUCCESS


class ForceFailure(_Mapping):
    """Fails when the child completes."""

    on_success = FAILURE
    on_failure = FAILURE


class KeepRunningUntilFailure(Decorator):
    """Runs the child again and again until it fails."""

    def tick(self) -> Status:
        """Tick the child; only its failure is passed on."""
        self.set_running()
        status = self.child.execute_tick()
        if status not in COMPLETED:
            return RUNNING
        self.child.reset()
        return FAILURE if status == FAILURE else RUNNING


class RunOnce(Decorator):
    """Runs the child to its end once in the lifetime of the tree; not even a halt re-arms it."""

    then_skip = Input(bool, default=True, description="true: skip from then on; false: repeat the first result")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._result = IDLE

    def tick(self) -> Status:
        """Tick the child unless it completed before."""
        if self._result != IDLE:
            return SKIPPED if self.then_skip else self._result
        self.set_running()
        status = self.child.execute_tick()
        if status in COMPLETED:
            self._result = status
            self.child.reset()
        return status
