"""The count of recoveries, which a navigator reports."""

from __future__ import annotations

from typing import Final

from behavior_tree import Node

ENTRY: Final = "number_recoveries"
"""The entry of the root blackboard; it is counted where it exists."""


def count_recovery(node: Node) -> None:
    """Count one more recovery."""
    root = node.blackboard.root
    entry = root.find(ENTRY)
    if entry is not None and isinstance(entry.value, int):
        root.set(ENTRY, entry.value + 1)
