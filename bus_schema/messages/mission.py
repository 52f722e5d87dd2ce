"""Missions: a behaviour tree, its nodes' statuses, its blackboard, and what the executor is asked to do."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from bus_schema.annotations import Count, PlainValue, Seconds, Text
from bus_schema.registry import message


class NodeStatus(Enum):
    """The stored status of a node, as BehaviorTree.CPP has it."""

    IDLE = "idle"
    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"
    SKIPPED = "skipped"


class MissionState(Enum):
    """What the executor does with its tree."""

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


@message("regraft/MissionStatus")
@dataclass(frozen=True, slots=True)
class MissionStatus:
    """The mission as it is: the tree in pre-order, the root blackboard, ticks so far, and why it failed."""

    stamp: Seconds
    state: MissionState
    tree: str
    ticks: Count
    nodes: tuple[MissionNode, ...] = ()
    blackboard: dict[str, PlainValue] = field(default_factory=dict)
    running: tuple[str, ...] = ()
    error: str = ""


@message("regraft/MissionRequest")
@dataclass(frozen=True, slots=True)
class MissionRequest:
    """Ask for the mission's status."""


class Command(Enum):
    """What the executor is to do. ``step`` ticks the paused tree once."""

    LOAD = "load"
    START = "start"
    PAUSE = "pause"
    STEP = "step"
    HALT = "halt"


@message("regraft/MissionCommand")
@dataclass(frozen=True, slots=True)
class MissionCommand:
    """Command the executor; ``tree`` is the XML text to load, ``main`` the tree's ID in it."""

    command: Command
    tree: Annotated[str, Text(1_000_000)] = ""
    main: str = ""
