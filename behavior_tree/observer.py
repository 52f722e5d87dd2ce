"""Counts what the nodes of a tree do, as BehaviorTree.CPP's TreeObserver does.

Nodes that nobody observes are ticked as before: an observer puts a hook into each node of one tree.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from .nodes.node import Node, PostTickHook, PreTickHook
from .status import COMPLETED, FAILURE, IDLE, SKIPPED, SUCCESS, Status
from .tree import Tree


@dataclass(slots=True)
class NodeCounts:
    """The counts of one node since it was observed, or since they were reset.

    BehaviorTree.CPP counts skips by stored statuses. It never stores SKIPPED, so its count stays 0; here it is that of
    the ticks that gave SKIPPED.

    Attributes:
        successes: Changes of the stored status to SUCCESS.
        failures: Changes of the stored status to FAILURE.
        transitions: Changes of the stored status, those to IDLE excluded.
        last_result: SUCCESS or FAILURE, whichever was stored last; IDLE before the first.
        last_time: The time of the last change of the stored status in seconds of the tree's clock, None before it.
        results: How many ticks gave each status.
        errors: How many ticks raised an error.
        unfinished: Whether a tick has begun that has given nothing: it is under way, or raised an error.
    """

    successes: int = 0
    failures: int = 0
    transitions: int = 0
    last_result: Status = IDLE
    last_time: float | None = None
    results: dict[Status, int] = field(default_factory=dict)
    errors: int = 0
    unfinished: bool = False

    @property
    def ticks(self) -> int:
        """The number of ticks."""
        return sum(self.results.values()) + self.errors + self.unfinished

    @property
    def skips(self) -> int:
        """The number of ticks that gave SKIPPED."""
        return self.results.get(SKIPPED, 0)


class TreeObserver:
    """Counts of all nodes of a tree, from when it is made until it is detached."""

    def __init__(self, tree: Tree) -> None:
        """Begin to count; a node's present hooks are kept."""
        self._tree = tree
        self._counts = [NodeCounts() for _ in tree.nodes]
        self._earlier = [(node.pre_tick_hook, node.post_tick_hook) for node in tree.nodes]
        for index, (node, (pre_tick, post_tick)) in enumerate(zip(tree.nodes, self._earlier, strict=True)):
            node.set_hooks(self._beginning(index, pre_tick), self._counting(index, post_tick))
        tree.add_transition_hook(self._note)

    @property
    def counts(self) -> Sequence[NodeCounts]:
        """The counts in the order of the tree's nodes."""
        return self._counts

    def reset(self) -> None:
        """Begin again from zero."""
        for index in range(len(self._counts)):
            self._counts[index] = NodeCounts()

    def detach(self) -> None:
        """Count no more; nodes have the hooks again that they had before."""
        for node, earlier in zip(self._tree.nodes, self._earlier, strict=True):
            node.set_hooks(*earlier)
        self._tree.remove_transition_hook(self._note)

    def _beginning(self, index: int, earlier: PreTickHook | None) -> PreTickHook:
        def begin(node: Node) -> Status | None:
            counts = self._counts[index]
            counts.errors += counts.unfinished
            counts.unfinished = True
            return earlier(node) if earlier is not None else None

        return begin

    def _counting(self, index: int, earlier: PostTickHook | None) -> PostTickHook:
        def count(node: Node, status: Status) -> Status | None:
            replaced = earlier(node, status) if earlier is not None else None
            result = replaced if replaced is not None and replaced in COMPLETED else status
            counts = self._counts[index]
            counts.unfinished = False
            results = counts.results
            results[result] = results.get(result, 0) + 1
            return replaced

        return count

    def _note(self, uid: int, _previous: Status, status: Status, time_s: float) -> None:
        counts = self._counts[uid - 1]
        counts.last_time = time_s
        if status == IDLE:
            return
        counts.transitions += 1
        if status == SUCCESS:
            counts.successes += 1
            counts.last_result = status
        elif status == FAILURE:
            counts.failures += 1
            counts.last_result = status
