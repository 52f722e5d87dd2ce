"""Breakpoints: a tick stops before or after a node, or the node gives a result that is forced on it.

The rules are those of the hooks of BehaviorTree.CPP's Groot2Publisher. A tick that stops calls a function, and
continues when that returns. Nodes of a tree without breakpoints are ticked as before.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from .nodes.node import Node
from .status import COMPLETED, Status, status_name
from .tree import Tree


class Position(Enum):
    """The moment of a node's tick."""

    BEFORE = "before"
    AFTER = "after"


@dataclass(frozen=True, slots=True)
class Breakpoint:
    """A place where a tick stops, or where a result is forced.

    Attributes:
        uid: The node.
        position: BEFORE is behind the node's pre-conditions, AFTER behind its post-conditions.
        result: SUCCESS or FAILURE, which the node gives without a stop: BEFORE instead of running. None stops.
        once: Whether it is gone when it was reached.
    """

    uid: int
    position: Position = Position.BEFORE
    result: Status | None = None
    once: bool = False


@dataclass(frozen=True, slots=True)
class Stop:
    """Where a tick has stopped.

    Attributes:
        node: The node.
        position: Whether the node is about to run, or has run.
        result: The node's result, None before it runs.
    """

    node: Node
    position: Position
    result: Status | None = None


StopFunction = Callable[[Stop], Status | None]
"""Called in the middle of a tick, which continues when it returns. SUCCESS or FAILURE is forced on the node."""


class Breakpoints:
    """The breakpoints of one tree."""

    def __init__(self, tree: Tree, stop: StopFunction) -> None:
        """Begin without breakpoints; ``stop`` is called where a tick stops."""
        self._tree = tree
        self._stop = stop
        self._by_place: dict[tuple[int, Position], Breakpoint] = {}
        self._stepping = False

    @property
    def stepping(self) -> bool:
        """Whether the tick stops before the next node that is about to run."""
        return self._stepping

    @stepping.setter
    def stepping(self, wanted: bool) -> None:
        self._stepping = wanted
        self._install()

    @property
    def all(self) -> tuple[Breakpoint, ...]:
        """The breakpoints, in the order of the tree's nodes."""
        places = sorted(self._by_place, key=lambda place: (place[0], place[1] is Position.AFTER))
        return tuple(self._by_place[place] for place in places)

    @property
    def installed(self) -> bool:
        """Whether a tick may stop, or a result be forced."""
        return self._stepping or bool(self._by_place)

    def set(self, wanted: Breakpoint) -> None:
        """Set a breakpoint, in place of one at the same place.

        Raises:
            ValueError: There is no such node, or the result is neither SUCCESS nor FAILURE.
        """
        if not 1 <= wanted.uid <= len(self._tree.nodes):
            raise ValueError(f"there is no node {wanted.uid}; there are 1 to {len(self._tree.nodes)}")
        if wanted.result is not None and wanted.result not in COMPLETED:
            raise ValueError(f"{status_name(wanted.result)} cannot be forced; SUCCESS and FAILURE can")
        self._by_place[wanted.uid, wanted.position] = wanted
        self._install()

    def remove(self, uid: int, position: Position) -> bool:
        """Remove the breakpoint at a place; return whether there was one."""
        removed = self._by_place.pop((uid, position), None)
        self._install()
        return removed is not None

    def clear(self) -> None:
        """Remove all breakpoints, and step no more."""
        self._by_place.clear()
        self.stepping = False

    def before(self, uid: int) -> Status | None:
        """Stop before a node if it is to; see `Debugger`."""
        return self._reached(uid, Position.BEFORE, None)

    def after(self, uid: int, status: Status) -> Status | None:
        """Stop after a node if it is to; see `Debugger`."""
        return self._reached(uid, Position.AFTER, status)

    def _reached(self, uid: int, position: Position, status: Status | None) -> Status | None:
        found = self._by_place.get((uid, position))
        if found is not None and found.once:
            self.remove(uid, position)
        if found is not None and found.result is not None:
            return found.result
        if found is None and not (self._stepping and position is Position.BEFORE):
            return None
        return self._stop(Stop(self._tree.nodes[uid - 1], position, status))

    def _install(self) -> None:
        self._tree.debug(self if self.installed else None)
