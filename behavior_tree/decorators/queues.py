"""Decorators that run the child for each item of a queue."""

from collections import deque
from typing import Any, ClassVar

from ..data.values import from_text, split_list, to_type
from ..nodes.decorator import Decorator
from ..nodes.node import Node, NodeSetup
from ..nodes.ports import InOut, Input, Output
from ..status import COMPLETED, FAILURE, IDLE, RUNNING, SUCCESS, Status


class _Loop(Decorator):
    """Takes an item off a queue, writes it, ticks the child, and is running until the queue is empty.

    The queue is literal text such as ``1;2;3``, read again at every start, or a blackboard entry. A
    ``collections.deque`` is shared, and used up by all who take from it. A list or text is copied at the first look
    and, as in BehaviorTree.CPP, never read again.
    """

    item_type: ClassVar[Any]

    queue = InOut[Any](description="items separated by semicolons, or the entry that holds them")
    if_empty = Input(Status, default=SUCCESS, description="the status once the queue is empty")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._items: deque[Any] | None = None
        self._literal: list[Any] | None = None
        self._child_runs = False

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Take the child and read a queue that is given as a literal."""
        super().adopt(children)
        if self.has_literal("queue"):
            self._literal = self._from_text(self.queue)
        elif "queue" not in self.setup.attributes:
            raise ValueError("input 'queue' is not given; it needs items such as 1;2;3, or a blackboard key")

    def tick(self) -> Status:
        """Take the next item unless the child is busy with the last one; tick the child."""
        if self.status == IDLE:
            self._child_runs = False
            if self._literal is not None:
                self._items = deque(self._literal)
        if not self._child_runs and not self._take():
            result: Status = self.if_empty
            return result
        self.set_running()
        status = self.child.execute_tick()
        self._child_runs = status == RUNNING
        if status in COMPLETED:
            self.child.reset()
        return FAILURE if status == FAILURE else RUNNING

    def _take(self) -> bool:
        if self._literal is None:
            self._look()
        if not self._items:
            return False
        item = self._items.popleft()
        if "value" in self.setup.writers:
            self.write_port("value", to_type(item, self.item_type, self.blackboard.converters))
        return True

    def _look(self) -> None:
        given = self.queue
        if isinstance(given, deque):
            self._items = given
        elif self._items is None:
            if not isinstance(given, str | list | tuple):
                raise ValueError(f"the queue must be a deque, a list or text, not {type(given).__name__}")
            self._items = deque(self._from_text(given) if isinstance(given, str) else given)

    def _from_text(self, text: str) -> list[Any]:
        return [from_text(item, self.item_type, self.blackboard.converters) for item in split_list(text)]


class LoopInt(_Loop):
    """Runs the child for each whole number of a queue."""

    item_type: ClassVar[Any] = int
    value = Output(int, description="the item")


class LoopBool(_Loop):
    """Runs the child for each truth value of a queue."""

    item_type: ClassVar[Any] = bool
    value = Output(bool, description="the item")


class LoopDouble(_Loop):
    """Runs the child for each real of a queue."""

    item_type: ClassVar[Any] = float
    value = Output(float, description="the item")


class LoopString(_Loop):
    """Runs the child for each text of a queue."""

    item_type: ClassVar[Any] = str
    value = Output(str, description="the item")
