"""Shows trees and their counts as lines of text."""

from __future__ import annotations

from collections.abc import Collection

from regraft.bus_schema.messages.mission import MissionCounts, MissionNode
from regraft.cli.terminal.output import show_table

MARKS = {"idle": " ", "running": ">", "success": "+", "failure": "!", "skipped": "-"}


def named(node: MissionNode) -> str:
    """Return a node's name, with its type where that is another."""
    return node.name if node.name == node.type else f"{node.name} ({node.type})"


def depths(nodes: Collection[MissionNode]) -> dict[int, int]:
    """Return how deep in the tree each node is, by its uid; the root is at 0."""
    found: dict[int, int] = {}
    for node in nodes:
        found[node.uid] = found.get(node.parent, -1) + 1
    return found


def tree_lines(nodes: Collection[MissionNode]) -> list[str]:
    """Return a tree as indented lines, each led by a mark for the node's status."""
    depth = depths(nodes)
    return [f"{MARKS[node.status.value]} {'  ' * depth[node.uid]}{named(node)}  {node.status.value}" for node in nodes]


def show_counts(nodes: Collection[MissionNode], counts: MissionCounts) -> None:
    """Print the counts of a tree's nodes as a table."""
    depth = depths(nodes)
    rows = []
    for node, counted in zip(nodes, counts.nodes, strict=True):
        numbers = (counted.ticks, counted.successes, counted.failures, counted.skips, counted.transitions)
        last = "" if counted.last_change is None else f"{counted.last_change:.2f} s"
        result = "" if counted.last_result.value == "idle" else counted.last_result.value
        rows.append((f"{'  ' * depth[node.uid]}{named(node)}", *(number or "" for number in numbers), result, last))
    headings = ("node", "ticks", "success", "failure", "skipped", "changes", "last result", "last change")
    show_table(headings, rows, empty="no nodes")
