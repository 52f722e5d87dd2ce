"""Missions: a behaviour tree, its nodes' statuses, its blackboard, and what the executor is asked to do."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count, PlainValue, Seconds, Text, Unit
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.quality import Quality


class NodeStatus(Enum):
    """The stored status of a node, as BehaviorTree.CPP has it."""

    IDLE = "idle"
    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"
    SKIPPED = "skipped"


class MissionState(Enum):
    """The state of the executor's tree."""

    EMPTY = "empty"
    LOADED = "loaded"
    RUNNING = "running"
    PAUSED = "paused"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    HALTED = "halted"


@message("regraft/MissionNode")
@dataclass(frozen=True, slots=True)
class MissionNode:
    """One node of the tree: uid and path as in BehaviorTree.CPP; ``parent`` is a uid, 0 for the root."""

    uid: Count
    parent: Count
    name: str
    type: str
    path: str
    status: NodeStatus
    ports: dict[str, str] = field(default_factory=dict)


class TickPosition(Enum):
    """The moment of a node's tick: behind its pre-conditions, or behind its post-conditions."""

    BEFORE = "before"
    AFTER = "after"


class ForcedResult(Enum):
    """A result that is forced on a node."""

    SUCCESS = "success"
    FAILURE = "failure"


@message("regraft/MissionStop")
@dataclass(frozen=True, slots=True)
class MissionStop:
    """The place at which the tree's tick has stopped; ``result`` is the node's, None before it runs."""

    uid: Count
    node: str
    position: TickPosition
    result: NodeStatus | None = None


@message("regraft/MissionStatus")
@dataclass(frozen=True, slots=True)
class MissionStatus:
    """The mission as it is: the tree in pre-order, the root blackboard, ticks so far, and why it failed.

    ``qualities`` holds the latest of each quality requirement in the tree's order, also of those not active any more.
    ``structure`` is equal for equal trees: when it changes, another tree has been loaded or swapped in, and uids
    mean other nodes. ``stop`` is where the tick has stopped at a breakpoint, None if it has not.
    """

    stamp: Seconds
    state: MissionState
    tree: str
    ticks: Count
    nodes: tuple[MissionNode, ...] = ()
    blackboard: dict[str, PlainValue] = field(default_factory=dict)
    running: tuple[str, ...] = ()
    error: str = ""
    structure: str = ""
    qualities: tuple[Quality, ...] = ()
    stop: MissionStop | None = None


@message("regraft/MissionRequest")
@dataclass(frozen=True, slots=True)
class MissionRequest:
    """Ask for the mission's status."""


@message("regraft/MissionTransition")
@dataclass(frozen=True, slots=True)
class MissionTransition:
    """A node's stored status changed; ``stamp`` is the tree's time."""

    uid: Count
    before: NodeStatus
    after: NodeStatus
    stamp: Seconds


@message("regraft/MissionTransitions")
@dataclass(frozen=True, slots=True)
class MissionTransitions:
    """All changes of one tick, or of a halt, in their order; ``structure`` states which tree the uids belong to.

    ``missed`` counts the changes behind these: a batch is bounded.
    """

    stamp: Seconds
    structure: str
    tick: Count
    changes: tuple[MissionTransition, ...]
    missed: Count = 0


@message("regraft/MissionCountsRequest")
@dataclass(frozen=True, slots=True)
class MissionCountsRequest:
    """Ask for the counts of the mission's nodes; ``reset`` has them begin again from zero afterwards."""

    reset: bool = False


@message("regraft/NodeCounts")
@dataclass(frozen=True, slots=True)
class NodeCounts:
    """The counts of a node since it is counted, as BehaviorTree.CPP's TreeObserver has them.

    ``successes``, ``failures`` and ``transitions`` count changes of the stored status, those to idle excluded.
    ``skips`` counts ticks, because a skipped node's status is not stored. ``last_result`` is idle before the first.
    ``last_change`` is the tree's time of the last change of the status, None before it.
    """

    uid: Count
    ticks: Count
    successes: Count
    failures: Count
    skips: Count
    transitions: Count
    last_result: NodeStatus
    last_change: Annotated[float, Unit("s")] | None = None


@message("regraft/MissionCounts")
@dataclass(frozen=True, slots=True)
class MissionCounts:
    """The counts of all nodes, in the order of the tree with this ``structure``."""

    stamp: Seconds
    structure: str
    nodes: tuple[NodeCounts, ...]


class BreakpointChange(Enum):
    """The change that is asked for: none, a breakpoint set or removed, or all removed."""

    NONE = "none"
    SET = "set"
    REMOVE = "remove"
    CLEAR = "clear"


@message("regraft/BreakpointsRequest")
@dataclass(frozen=True, slots=True)
class BreakpointsRequest:
    """Ask for the breakpoints of the mission's tree, after a change.

    ``node`` is a path, a name that one node alone has, or a uid. With a ``result`` the node gives that, and the tick
    does not stop. A breakpoint for ``once`` is gone when it was reached.
    """

    change: BreakpointChange = BreakpointChange.NONE
    node: str = ""
    position: TickPosition = TickPosition.BEFORE
    result: ForcedResult | None = None
    once: bool = False


@message("regraft/MissionBreakpoint")
@dataclass(frozen=True, slots=True)
class MissionBreakpoint:
    """A breakpoint: a node by uid and path, the moment of its tick, and what is forced there, if anything."""

    uid: Count
    node: str
    position: TickPosition
    result: ForcedResult | None = None
    once: bool = False


@message("regraft/MissionBreakpoints")
@dataclass(frozen=True, slots=True)
class MissionBreakpoints:
    """The breakpoints of the tree with this ``structure``, in the order of its nodes."""

    stamp: Seconds
    structure: str
    breakpoints: tuple[MissionBreakpoint, ...]


@message("regraft/BlackboardRequest")
@dataclass(frozen=True, slots=True)
class BlackboardRequest:
    """Ask for one entry, or all of a board: the root's, or that of the sub-tree with this path."""

    key: str = ""
    board: str = ""


@message("regraft/BlackboardEntry")
@dataclass(frozen=True, slots=True)
class BlackboardEntry:
    """An entry: what is no plain data is shown as text. ``age`` is None and ``value`` too before the first write.

    ``sequence`` counts the writes, ``type`` is what the entry takes: ``any`` as long as nothing has fixed it.
    """

    key: str
    value: PlainValue
    type: str
    sequence: Count
    age: Annotated[float, Unit("s"), Bounds(minimum=0.0)] | None


@message("regraft/BlackboardEntries")
@dataclass(frozen=True, slots=True)
class BlackboardEntries:
    """Entries of one board in order of creation, and the paths of the other boards that there are."""

    stamp: Seconds
    board: str
    entries: tuple[BlackboardEntry, ...]
    boards: tuple[str, ...] = ()


@message("regraft/WriteBlackboard")
@dataclass(frozen=True, slots=True)
class WriteBlackboard:
    """Write entries, all or none; None removes one. The reply is ``regraft/BlackboardEntries`` with those written."""

    values: dict[str, PlainValue]
    board: str = ""


class Command(Enum):
    """A command for the executor.

    ``step`` ticks the paused tree once. ``swap`` has another tree take over from the one that is under way, which is
    halted; the entries of the root blackboard are carried over. ``check`` only reports what is wrong with a tree.
    ``continue`` continues a tick that has stopped at a breakpoint, ``next`` up to the next node that runs.
    """

    LOAD = "load"
    START = "start"
    PAUSE = "pause"
    STEP = "step"
    HALT = "halt"
    SWAP = "swap"
    CHECK = "check"
    CONTINUE = "continue"
    NEXT = "next"


@message("regraft/MissionCommand")
@dataclass(frozen=True, slots=True)
class MissionCommand:
    """Command the executor; ``tree`` is the XML text to load or swap in, ``main`` the tree's ID in it.

    With ``main`` alone, the tree is that of the executor's own file or of its library. ``result`` goes with
    ``continue`` and ``next``: the node at which the tick has stopped gives that.
    """

    command: Command
    tree: Annotated[str, Text(1_000_000)] = ""
    main: str = ""
    result: ForcedResult | None = None
