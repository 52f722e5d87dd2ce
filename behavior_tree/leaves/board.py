"""Leaves that write and remove blackboard entries."""

from typing import Any

from ..data.values import to_type
from ..errors import PortError
from ..nodes.leaf import SyncAction
from ..nodes.ports import InOut, Input
from ..nodes.text import board_key
from ..status import FAILURE, SUCCESS, Status


class SetBlackboard(SyncAction):
    """Writes an entry: literal text, or a copy of another entry with its type.

    Fails if the other entry is empty. Text is converted to the type of an entry that exists.
    """

    value = Input[Any](description="literal text, or the entry to copy")
    output_key = InOut(str, description="the name of the entry to write")

    def tick(self) -> Status:
        """Write the entry."""
        text = self.setup.attributes.get("value")
        if text is None:
            raise PortError("input 'value' is not given", node=self.path)
        target = self.output_key
        source_key = board_key(text, "value")
        if source_key is None:
            self.blackboard.set(target, self._converted(target, text))
            return SUCCESS
        source = self.blackboard.find(source_key)
        if source is None:
            raise PortError(f"input 'value': there is no blackboard entry '{source_key}'", node=self.path)
        if self.blackboard.find(target) is None:
            self.blackboard.declare(target, source.type)
        if source.value is None:
            return FAILURE
        self.blackboard.set(target, source.value)
        return SUCCESS

    def _converted(self, target: str, text: str) -> Any:
        """Return text for an entry without a type as what the entry holds; BehaviorTree.CPP would empty it."""
        entry = self.blackboard.find(target)
        if entry is None or entry.type is not None or entry.value is None:
            return text
        return to_type(text, type(entry.value), self.blackboard.converters)


class UnsetBlackboard(SyncAction):
    """Removes an entry of its sub-tree's own board; succeeds also if there is none.

    As in BehaviorTree.CPP, a key that leads to another board, by remapping or with ``@``, is left alone.
    """

    key = Input(str, description="the name of the entry")

    def tick(self) -> Status:
        """Remove the entry."""
        self.blackboard.unset_own(self.key)
        return SUCCESS
