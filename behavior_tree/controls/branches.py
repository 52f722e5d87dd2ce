"""Nodes whose first child decides which of the others is ticked."""

from typing import ClassVar

from ..nodes.control_node import Control
from ..nodes.node import Node, NodeSetup
from ..status import FAILURE, RUNNING, SKIPPED, SUCCESS, Status


class _Branching(Control):
    min_children: ClassVar[int] = 2
    max_children: ClassVar[int | None] = 3
    resets_before_error: ClassVar[bool] = False

    def _tick_condition(self) -> Status:
        status = self.children[0].execute_tick()
        if status == SKIPPED:
            condition = self.children[0].path
            if self.resets_before_error:
                self.reset_children()
            raise ValueError(f"its condition '{condition}' was skipped, so neither branch can be chosen")
        return status

    def _tick_branch(self, branch: Node) -> Status:
        status = branch.execute_tick()
        if status != RUNNING:
            self.reset_children()
        return status


class IfThenElse(_Branching):
    """Asks the first child once, then ticks the second (success) or third (failure) until it completes.

    Without a third child a failed condition is the result, and the condition is not reset: a stateful one
    then repeats its failure.
    """

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._branch = 0

    def tick(self) -> Status:
        """Tick the condition unless a branch is chosen, then the branch."""
        self.set_running()
        if self._branch == 0:
            status = self._tick_condition()
            if status == RUNNING:
                return RUNNING
            if status == FAILURE and len(self.children) == 2:
                return FAILURE
            self._branch = 1 if status == SUCCESS else 2
        status = self._tick_branch(self.children[self._branch])
        if status != RUNNING:
            self._branch = 0
        return status

    def halt(self) -> None:
        """Reset all children and forget the branch."""
        self._branch = 0
        super().halt()


class WhileDoElse(_Branching):
    """Asks the first child at every tick; ticks the second while it succeeds and the third while it fails."""

    resets_before_error: ClassVar[bool] = True  # as BehaviorTree.CPP does, unlike its IfThenElse

    def tick(self) -> Status:
        """Tick the condition, halt the branch that it rules out, and tick the other."""
        self.set_running()
        status = self._tick_condition()
        if status == RUNNING:
            return RUNNING
        wanted, unwanted = (1, 2) if status == SUCCESS else (2, 1)
        if unwanted < len(self.children):
            self.children[unwanted].reset()
        if wanted == len(self.children):
            self.reset_children()
            return FAILURE
        return self._tick_branch(self.children[wanted])
