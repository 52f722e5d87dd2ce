"""Runs a mission's tree without a robot: mocks replace the nodes that act, and time is the tree's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from behavior_tree import (
    RUNNING,
    ManualClock,
    Node,
    NodeCounts,
    NodeError,
    Tree,
    TreeLibrary,
    TreeObserver,
    status_name,
)
from behavior_tree.mocking import mock_outside
from behavior_tree.status import COMPLETED, FAILURE, SUCCESS, Status
from behavior_tree.substitution import MockAction, MockCondition, MockControl, MockDecorator
from regraft.bus_schema.annotations import PlainValue
from regraft.cli.outcomes import BadInput
from regraft.services.bt_executor.authors.reading import loaded
from regraft.services.bt_executor.boards import BoardRefusal, write_board
from regraft.services.bt_executor.checking import KnownNodes
from regraft.services.bt_executor.mission import MAX_TICKS_AT_ONCE
from regraft.services.bt_executor.mocks import with_mocks
from regraft.services.bt_executor.source import Unloadable

PERIOD: Final = 0.1
"""Seconds between two ticks, as with the executor's default rate; a timer that comes due brings one earlier."""
MAX_NODE_TICKS: Final = 20_000_000
"""Ticks of the root times nodes of the tree: how long a run may take that a mission's own time does not end."""
MOCKS: Final = (MockAction, MockCondition, MockControl, MockDecorator)


@dataclass(frozen=True, slots=True)
class NodeRun:
    """The ticks of one node, and how many of them gave each status; ``depth`` is 0 for the root."""

    path: str
    name: str
    type: str
    depth: int
    mocked: bool
    ticks: int
    running: int
    successes: int
    failures: int
    skips: int


@dataclass(frozen=True, slots=True)
class DryRun:
    """The outcome of a tree's run.

    ``result`` is a status; RUNNING if the time was over first. ``seconds`` is the tree's own time. ``coverage`` is the
    part of the nodes that were ticked at all, in [0, 1]. ``unused_rules`` have put nothing in any node's place.
    """

    tree: str
    result: str
    error: str
    ticks: int
    seconds: float
    reached: int
    coverage: float
    nodes: tuple[NodeRun, ...]
    unused_rules: tuple[str, ...]
    warnings: tuple[str, ...]


def dry_run(
    file: Path,
    known: KnownNodes,
    *,
    mocks: Path | None = None,
    main: str = "",
    library: TreeLibrary | None = None,
    entries: Mapping[str, PlainValue],
    seconds: float,
) -> DryRun:
    """Run a file's tree until it is done, or until a time of its clock is over.

    Args:
        file: The file.
        known: The node types; those that act on what is outside the tree are mocked.
        mocks: A file with rules of what else takes nodes' places.
        main: The ID of the tree, by default that of the file.
        library: Where sub-trees are that the file does not have.
        entries: Values that are written to the root blackboard first.
        seconds: The longest time, by the tree's clock.

    Raises:
        BadInput: the tree cannot be built, the rules are faulty, or an entry does not fit.
    """
    try:
        registry = with_mocks(known.registry, mocks) if mocks is not None else known.registry.copy()
    except Unloadable as unloadable:
        raise BadInput(str(unloadable)) from None
    mock_outside(registry)
    clock = ManualClock()
    tree = loaded(file, replace(known, registry=registry), main, clock, library)
    if entries:
        try:
            write_board(tree, "", entries, 0.0)
        except BoardRefusal as refusal:
            raise BadInput(str(refusal)) from None
    observer = TreeObserver(tree)
    result, error, ticks = _run(tree, clock, seconds)
    nodes = _node_runs(tree, observer)
    reached = sum(node.ticks > 0 for node in nodes)
    coverage = round(reached / len(nodes), 4)
    unused, warnings = registry.substitutions.unused, tree.warnings
    name = status_name(result)
    return DryRun(tree.tree_id, name, error, ticks, clock.now(), reached, coverage, nodes, unused, warnings)


def _run(tree: Tree, clock: ManualClock, seconds: float) -> tuple[Status, str, int]:
    """Tick a tree to its end; return the result, the error if it is one, and the number of the root's ticks."""
    most = max(1, MAX_NODE_TICKS // len(tree.nodes))
    for ticks in range(1, most + 1):
        try:
            status = tree.tick_once(MAX_TICKS_AT_ONCE)
        except NodeError as error:
            return FAILURE, str(error), ticks
        if status in COMPLETED or clock.now() >= seconds:
            return (status if status in COMPLETED else RUNNING), "", ticks
        due, now = tree.next_wake_up(), clock.now()
        following = now + PERIOD if due is None or due <= now else min(due, now + PERIOD)
        clock.advance_to(min(following, seconds))
    return RUNNING, f"not done after {most} ticks", most


def _node_runs(tree: Tree, observer: TreeObserver) -> tuple[NodeRun, ...]:
    depths = {tree.root.uid: 0}
    for node in tree.nodes:
        for child in node.children:
            depths[child.uid] = depths[node.uid] + 1
    counted = zip(tree.nodes, observer.counts, strict=True)
    return tuple(_node_run(node, counts, depths[node.uid]) for node, counts in counted)


def _node_run(node: Node, counts: NodeCounts, depth: int) -> NodeRun:
    running, successes, failures = (counts.results.get(status, 0) for status in (RUNNING, SUCCESS, FAILURE))
    mocked = isinstance(node, MOCKS)
    shown = node.setup.subtree_id or node.type_id
    return NodeRun(node.path, node.name, shown, depth, mocked, counts.ticks, running, successes, failures, counts.skips)
