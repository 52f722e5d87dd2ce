"""The nodes of a tree as others see them, made once for each tree and each change of a status."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Final

from behavior_tree import Node, Tree
from behavior_tree.status import STATUS_NAMES
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.mission import MissionNode, NodeStatus

STATUSES: Final = tuple(NodeStatus(name.lower()) for name in STATUS_NAMES)
"""The statuses by the engine's numbers."""


class Structure:
    """A tree's nodes, and a digest that distinguishes them from another tree's.

    Attributes:
        digest: Equal for equal trees: of all nodes' types, names, paths, parents and ports.
    """

    def __init__(self, tree: Tree) -> None:
        parents = {child.uid: node.uid for node in tree.nodes for child in node.children}
        self._tree = tree
        self._nodes = [_described(node, parents.get(node.uid, 0)) for node in tree.nodes]
        digest = hashlib.sha256()
        for node in self._nodes:
            digest.update(codec.encode(replace(node, status=NodeStatus.IDLE)))
        self.digest = digest.hexdigest()[:16]

    def nodes(self) -> tuple[MissionNode, ...]:
        """Return the nodes with their statuses now."""
        for index, node in enumerate(self._tree.nodes):
            status = STATUSES[node.status]
            if self._nodes[index].status is not status:
                self._nodes[index] = replace(self._nodes[index], status=status)
        return tuple(self._nodes)


def _described(node: Node, parent: int) -> MissionNode:
    return MissionNode(
        node.uid, parent, node.name, node.type_id, node.path, STATUSES[node.status], dict(node.setup.attributes)
    )
