"""Finds adapt decorators that a reactive parent has adapt again at each tick."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from behavior_tree import Condition, Node, SyncAction, Tree
from regraft.services.bt_executor.adaptation.variants import RESTARTING

REACTIVE: Final = ("ReactiveSequence", "ReactiveFallback")
"""Parents that tick all their children from the first at each tick; their last child ends them."""
ASKING: Final = "WhileDoElse"
"""The parent that ticks its first child at each tick."""
ONCE: Final = ("RunOnce", "SingleTrigger")
"""Decorators below which nothing is started again."""


def repeated_adaptations(tree: Tree) -> tuple[str, ...]:
    """Return a warning, with file and line, for each adapt decorator that adapts at each tick."""
    return tuple(
        f"{node.setup.file or '<text>'}:{node.setup.line}: {node.type_id} '{node.name}' adapts at each tick, because "
        f"'{parent.name}' ({parent.type_id}) starts it again: put it around that, or into a RunOnce"
        for node, parent in _restarted(tree.root)
        if isinstance(node, RESTARTING) and _ends_at_once(node)
    )


def _restarted(root: Node) -> Iterator[tuple[Node, Node]]:
    """Yield each node that is started again at each tick, with the parent that has it done."""
    pending: list[tuple[Node, Node | None]] = [(root, None)]
    while pending:
        node, restarter = pending.pop()
        if restarter is not None:
            yield node, restarter
        for index, child in reversed(list(enumerate(node.children))):
            pending.append((child, _restarter(node, index) or (None if node.type_id in ONCE else restarter)))


def _restarter(parent: Node, index: int) -> Node | None:
    is_last = index == len(parent.children) - 1
    starts_again = (parent.type_id in REACTIVE and not is_last) or (parent.type_id == ASKING and index == 0)
    return parent if starts_again else None


def _ends_at_once(node: Node) -> bool:
    """Return whether all leaves below a node complete in the tick in which they start."""
    pending = list(node.children)
    while pending:
        below = pending.pop()
        if not below.children and not isinstance(below, Condition | SyncAction):
            return False
        pending.extend(below.children)
    return True
