"""Writes a tree as a graph in Graphviz's language.

Control nodes and actions are boxes, those of actions rounded. Conditions are ellipses, decorators are hexagons. Each
sub-tree has a frame around its nodes. Children are in order from left to right.
"""

from collections.abc import Iterator
from typing import Final

from .nodes.manifest import NodeKind
from .nodes.node import Node
from .tree import Tree

MAX_TEXT: Final = 60
"""Characters of a port's text that are drawn."""
_SHAPES: Final = {
    NodeKind.ACTION: "shape=box, style=rounded",
    NodeKind.CONDITION: "shape=ellipse",
    NodeKind.CONTROL: "shape=box",
    NodeKind.DECORATOR: "shape=hexagon",
    NodeKind.SUBTREE: "shape=tab",
}


def dot(tree: Tree) -> str:
    """Return a tree as a graph; names, types and ports are in the labels."""
    return "\n".join(_lines(tree))


def _lines(tree: Tree) -> Iterator[str]:
    yield f"digraph {_quoted(tree.tree_id or 'tree')} {{"
    yield "  ordering=out;"
    yield "  node [fontname=Helvetica, fontsize=10];"
    # A list of what is still to be written: sub-trees may be nested more deeply than functions may call each other.
    pending: list[tuple[Node | None, int]] = [(tree.root, 1)]
    while pending:
        node, depth = pending.pop()
        if node is None:
            yield f"{'  ' * depth}}}"
            continue
        yield f"{'  ' * depth}n{node.uid} [{_SHAPES[node.kind]}, label={_quoted(_label(node))}];"
        if node.kind is NodeKind.SUBTREE and node.children:
            yield f"{'  ' * depth}subgraph cluster_{node.uid} {{"
            yield f"{'  ' * (depth + 1)}label={_quoted(node.setup.subtree_id)};"
            pending.append((None, depth))
            depth += 1
        pending.extend((child, depth) for child in reversed(node.children))
    for node in tree.nodes:
        for child in node.children:
            yield f"  n{node.uid} -> n{child.uid};"
    yield "}"


def _label(node: Node) -> str:
    type_id = node.setup.subtree_id or node.type_id
    first = node.name if node.name == type_id else f"{node.name}\n{type_id}"
    ports = [f"{name} = {_short(text)}" for name, text in node.setup.attributes.items()]
    return "\n".join([first, *ports])


def _short(text: str) -> str:
    return text if len(text) <= MAX_TEXT else f"{text[:MAX_TEXT]}…"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\r", " ").replace("\n", "\\n")
    return f'"{escaped}"'
