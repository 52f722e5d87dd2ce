"""The leaf that notices changes of a blackboard entry."""

from typing import Any

from ..nodes.leaf import SyncAction
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..nodes.updates import EntryWatch
from ..status import FAILURE, SUCCESS, Status


class WasEntryUpdated(SyncAction):
    """Succeeds if an entry was written since the last look, else fails."""

    entry = Input[Any](description="the blackboard entry to watch")

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._watch = EntryWatch(self)

    def tick(self) -> Status:
        """Look at the entry."""
        return SUCCESS if self._watch.was_written() else FAILURE
