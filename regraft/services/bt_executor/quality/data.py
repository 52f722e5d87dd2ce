"""How old the blackboard entries are that a requirement's data come from, and when they are written."""

from __future__ import annotations

from typing import Any

from behavior_tree import Blackboard, Entry, Node
from behavior_tree.nodes.text import board_key
from regraft.services.bt_executor.quality.over_time import Unknown

AGE, STALE = "_age", "_stale"
"""The system reflection keeps next to ``KEY`` the seconds since its source's stamp, and whether that is too long."""


def age_of(board: Blackboard, key: str, now: float) -> float:
    """Return how many seconds ago the value of an entry was true.

    That is the value of its age entry, or the time since it was written where it has none.

    Raises:
        Unknown: there is no value, or its source states that it is stale.
    """
    entry = board.find(key)
    if entry is None or entry.value is None:
        raise Unknown(f"there are no data in '{key}'")
    if _beside(board, key, entry, STALE) is True:
        raise Unknown(f"the data in '{key}' are stale")
    told = _beside(board, key, entry, AGE)
    is_told = isinstance(told, int | float) and not isinstance(told, bool)
    return float(told) if is_told else max(now - entry.stamp, 0.0)


def _beside(board: Blackboard, key: str, entry: Entry, what: str) -> Any:
    """Return the companion of an entry, None if there is none."""
    found = board.find(key + what)
    if found is None and board is not board.root:
        # A sub-tree may have the entry under a name of its own.
        names = [name for name in board.root.dump() if board.root.find(name) is entry]
        found = board.root.find(names[0] + what) if names else None
    return found.value if found else None


class Writes:
    """Notices when the entry that a node's port is connected to is written again, be it with the same value."""

    def __init__(self, node: Node, port: str) -> None:
        self._board = node.blackboard
        self._key = board_key(node.setup.attributes.get(port, ""), port) or ""
        self._sequence = self._now()

    def _now(self) -> int:
        entry = self._board.find(self._key) if self._key else None
        return entry.sequence if entry else 0

    def are_new(self) -> bool:
        """Return whether it was written since the last call."""
        before, self._sequence = self._sequence, self._now()
        return before != self._sequence
