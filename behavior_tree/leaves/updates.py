"""The leaf that notices changes of a blackboard entry."""

from typing import Any

from ..leaf import SyncAction
from ..node import NodeSetup
from ..ports import Input
from ..status import FAILURE, SUCCESS, Status
from ..updates import EntryWatch


class WasEntryUpdated(SyncAction):
    """Succeeds if an entry was written since the last look, else fails."""

    entry = Input[Any](description="the blackboard entry to watch")

    def __init__(self, setup: NodeSetup) -> None:
        """Begin to watch."""
        super().__init__(setup)
        self._watch = EntryWatch(self)

    def tick(self) -> Status:
        """Look at the entry."""
        return SUCCESS if self._watch.was_written() else FAILURE
