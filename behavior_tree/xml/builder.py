"""Makes the nodes of a tree from its elements."""

import time
from dataclasses import dataclass, field, replace
from typing import Final

from ..data.blackboard import Blackboard
from ..data.values import literal_value, parse_bool
from ..errors import LoadError, TreeError
from ..node_registry import Registry
from ..nodes.leaf import StatefulAction
from ..nodes.manifest import NodeKind
from ..nodes.node import Node, NodeSetup
from ..nodes.runtime import Runtime
from ..nodes.text import board_key
from ..substitution import Substitution
from .attributes import compile_conditions, sort_attributes
from .binding import bind_ports
from .checks import type_of
from .collection import TreeCollection
from .document import Element

MAX_NODES: Final = 20_000
"""Sub-trees that use sub-trees can ask for more nodes than there is memory."""
LEAVES: Final = (NodeKind.ACTION, NodeKind.CONDITION)


@dataclass(slots=True)
class Builder:
    """Makes nodes, numbering them in order of creation, parents before children.

    Attributes:
        collection: All trees.
        registry: All node types.
        runtime: The parts that the nodes share.
        nodes: The nodes made so far.
        boards: The blackboards by the path of their sub-tree; the main tree's is added by the caller.
        seconds: How long it may take, None for any time.
    """

    collection: TreeCollection
    registry: Registry
    runtime: Runtime
    nodes: list[Node] = field(default_factory=list)
    boards: dict[str, Blackboard] = field(default_factory=dict)
    seconds: float | None = None
    _began: float = field(default_factory=time.monotonic)

    def build_tree(self, tree_id: str, board: Blackboard, prefix: str) -> Node:
        """Make the nodes of a tree and return its root.

        Args:
            tree_id: The tree.
            board: Its blackboard.
            prefix: The start of the paths of its nodes.

        Raises:
            LoadError: A node cannot be made; the error names the place.
        """
        return self._build(self.collection.trees[tree_id].children[0], board, prefix)

    def _build(self, element: Element, board: Blackboard, prefix: str) -> Node:
        setup = self._setup(element, board, prefix)
        try:
            node = self._node(setup)
            self.nodes.append(node)
            if node.kind is NodeKind.SUBTREE:
                children: tuple[Node, ...] = (self._build_subtree(element, setup),)
            elif node.kind in LEAVES and setup.manifest.kind not in LEAVES:
                children = ()  # A leaf took the place of a node with children.
            else:
                # A generator would take C's stack at each level, which Python 3.12 bounds apart.
                children = tuple([self._build(child, board, prefix) for child in element.children])
            node.adopt(children)
        except LoadError:
            raise
        except (TreeError, ValueError) as error:
            message = error.message if isinstance(error, TreeError) else str(error)
            raise LoadError(message, file=element.file, line=element.line, node=setup.path) from error
        # An author's node may raise anything when it is made.
        except Exception as error:
            message = f"a {setup.manifest.type_id} could not be made: {type(error).__name__}: {error}"
            raise LoadError(message, file=element.file, line=element.line, node=setup.path) from error
        self._warn_of_repeated_results(element, node)
        return node

    def _node(self, setup: NodeSetup) -> Node:
        if len(self.nodes) >= MAX_NODES:
            raise ValueError(f"the tree has more than {MAX_NODES} nodes, counting each use of a sub-tree")
        if self.seconds is not None and time.monotonic() - self._began > self.seconds:
            raise ValueError(f"making the tree takes longer than {self.seconds:g} s, up to node {len(self.nodes) + 1}")
        if not len(self.registry.substitutions):
            return self.registry.build(setup)
        types = (setup.manifest.type_id, setup.subtree_id) if setup.subtree_id else (setup.manifest.type_id,)
        substitution = self.registry.substitutions.find(setup.name, types, setup.path)
        if substitution is None:
            return self.registry.build(setup)
        return self.registry.build_substitute(self._for_substitute(setup, substitution), substitution)

    def _for_substitute(self, setup: NodeSetup, substitution: Substitution) -> NodeSetup:
        """Return what a substitute is made from: the original's ports, and the defaults of its own type."""
        manifest = self.registry.manifests.get(substitution) if isinstance(substitution, str) else None
        if manifest is None:
            return setup
        if manifest.kind is NodeKind.SUBTREE and not setup.subtree_id:
            raise ValueError("a sub-tree cannot take another node's place")
        element = Element(manifest.type_id, {}, setup.file, setup.line)
        texts = {name: text for name, text in setup.attributes.items() if name in manifest.ports}
        readers, writers = bind_ports(element, manifest, texts, setup.blackboard, setup.path)
        return replace(setup, manifest=manifest, attributes=texts, readers=readers, writers=writers)

    def _setup(self, element: Element, board: Blackboard, prefix: str) -> NodeSetup:
        manifest = self.registry.manifests[type_of(element)]
        attributes = sort_attributes(element, manifest)
        self.collection.warnings.extend(attributes.warnings)
        uid = len(self.nodes) + 1
        subtree_id = element.attributes["ID"] if manifest.kind is NodeKind.SUBTREE else ""
        default_name = subtree_id or manifest.type_id
        path = prefix + (attributes.name or f"{default_name}::{uid}")
        readers, writers = bind_ports(element, manifest, attributes.ports, board, path)
        return NodeSetup(
            uid=uid,
            name=attributes.name or default_name,
            path=path,
            manifest=manifest,
            blackboard=board,
            runtime=self.runtime,
            attributes=attributes.ports,
            other_attributes=attributes.other,
            readers=readers,
            writers=writers,
            conditions=compile_conditions(element, attributes.conditions, board, self.runtime),
            subtree_id=subtree_id,
            file=element.file,
            line=element.line,
        )

    def _build_subtree(self, element: Element, setup: NodeSetup) -> Node:
        if setup.path in self.boards:
            raise element.error(f"two sub-trees have the path '{setup.path}'; give them different names")
        board = self._subtree_board(element, setup)
        self.boards[setup.path] = board
        return self.build_tree(setup.subtree_id, board, setup.path + "/")

    def _subtree_board(self, element: Element, setup: NodeSetup) -> Blackboard:
        autoremap = parse_bool(setup.other_attributes.get("_autoremap", "false"))
        texts = self._with_model(element, setup, autoremap)
        keys = {name: board_key(text, name) for name, text in texts.items()}
        remaps = {name: key for name, key in keys.items() if key is not None}
        board = Blackboard(setup.blackboard, remaps=remaps, autoremap=autoremap)
        for name, text in texts.items():
            if keys[name] is None:
                board.set_constant(name, literal_value(text))
        return board

    def _with_model(self, element: Element, setup: NodeSetup, autoremap: bool) -> dict[str, str]:
        """Return the connections of a sub-tree, completed by the defaults of its model."""
        texts = dict(setup.attributes)
        for name, port in self.collection.models.get(setup.subtree_id, {}).items():
            if name in texts or autoremap:
                continue
            if port.default is None:
                raise element.error(f"sub-tree '{setup.subtree_id}' needs the port '{name}'")
            texts[name] = port.default
        return texts

    def _warn_of_repeated_results(self, element: Element, node: Node) -> None:
        asks_child = node.type_id == "WhileDoElse" or (node.type_id == "IfThenElse" and len(node.children) == 2)
        if asks_child and isinstance(node.children[0], StatefulAction):
            self.collection.warnings.append(
                f"{element.place}: {node.type_id} asks a stateful action, which repeats its result"
            )
