"""Notices whether a blackboard entry was written since the last look."""

from .node import Node
from .text import board_key


class EntryWatch:
    """Watches the entry that a node's port ``entry`` names, with or without braces."""

    def __init__(self, node: Node) -> None:
        """Watch from the first write on.

        Raises:
            ValueError: The node is given no entry.
        """
        text = node.setup.attributes.get("entry", "").strip()
        if not text:
            raise ValueError("input 'entry' is not given; name a blackboard entry")
        self._key = board_key(text, "entry") or text
        self._blackboard = node.blackboard
        self._sequence = 0

    def was_written(self) -> bool:
        """Return whether the entry was written since the last call, or ever before the first."""
        entry = self._blackboard.find(self._key)
        if entry is None:
            return False
        previous, self._sequence = self._sequence, entry.sequence
        return entry.sequence != previous
