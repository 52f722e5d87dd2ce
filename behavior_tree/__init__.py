"""A behaviour-tree engine that runs the XML of BehaviorTree.CPP, version 4, with its semantics.

    registry = Registry()
    registry.register(MoveTo, robot=robot)
    tree = load_file("mission.xml", registry)
    while tree.tick_once() == RUNNING:
        wait_until(tree.next_wake_up())

Nodes are written by subclassing `SyncAction`, `StatefulAction`, `CoroutineAction`, `Condition`, `Decorator` or
`Control` and declaring ports with `Input`, `Output` and `InOut`. The library needs only Python's standard library.
Nav2's control nodes and decorators are in `nav2`, substitutes for dry runs in `substitution` and `mocking`; `replay`
compares with what BehaviorTree.CPP did.

Where it differs from BehaviorTree.CPP 4.10 on purpose:

- Halting a tree runs ``_onHalted`` once and only of nodes that were running; a node that fails to halt does
  not keep the others from it.
- Timeout halts its child in its next tick, not from another thread; the results are the same.
- Errors in a condition script name the node that has the script, not its parent.
- A number given to a sub-tree as a literal may be read as text.
- A wrong number of children, a threshold beyond it, and two trees of one ID are errors at load.
- A long-form element may be a direct child of ReactiveSequence.
- Of several substitution rules that fit a node, the exact name goes first, then the type, then the path.
- ``ros_pkg`` is looked up on a search path.
"""

from .breakpoints import Breakpoint, Breakpoints, Position, Stop
from .clock import Clock, ManualClock, MonotonicClock
from .data.blackboard import Blackboard, Entry
from .data.values import UInt8, UInt16, UInt32, UInt64
from .errors import (
    BlackboardError,
    LoadError,
    NodeError,
    PortError,
    RegistryError,
    ScriptError,
    TreeError,
    UnknownTypeError,
)
from .library import TreeLibrary
from .load import load_file, load_from_library, load_text
from .mocking import mock_models
from .node_registry import Registry
from .nodes.control_node import Control
from .nodes.coroutine import CoroutineAction, Steps
from .nodes.decorator import Decorator
from .nodes.leaf import Condition, StatefulAction, SyncAction
from .nodes.limits import Limits
from .nodes.manifest import Direction, NodeKind, NodeManifest, PortModel
from .nodes.node import Node, NodeSetup, PostTickHook, PreTickHook
from .nodes.ports import InOut, Input, Output
from .nodes.runtime import TransitionHook
from .observer import NodeCounts, TreeObserver
from .status import FAILURE, IDLE, RUNNING, SKIPPED, SUCCESS, Status, status_from_name, status_name
from .substitution import MockConfig
from .tree import Tree
from .xml.models import read_manifests

__all__ = [
    "FAILURE",
    "IDLE",
    "RUNNING",
    "SKIPPED",
    "SUCCESS",
    "Blackboard",
    "BlackboardError",
    "Breakpoint",
    "Breakpoints",
    "Clock",
    "Condition",
    "Control",
    "CoroutineAction",
    "Decorator",
    "Direction",
    "Entry",
    "InOut",
    "Input",
    "Limits",
    "LoadError",
    "ManualClock",
    "MockConfig",
    "MonotonicClock",
    "Node",
    "NodeCounts",
    "NodeError",
    "NodeKind",
    "NodeManifest",
    "NodeSetup",
    "Output",
    "PortError",
    "PortModel",
    "Position",
    "PostTickHook",
    "PreTickHook",
    "Registry",
    "RegistryError",
    "ScriptError",
    "StatefulAction",
    "Status",
    "Steps",
    "Stop",
    "SyncAction",
    "TransitionHook",
    "Tree",
    "TreeError",
    "TreeLibrary",
    "TreeObserver",
    "UInt8",
    "UInt16",
    "UInt32",
    "UInt64",
    "UnknownTypeError",
    "load_file",
    "load_from_library",
    "load_text",
    "mock_models",
    "read_manifests",
    "status_from_name",
    "status_name",
]
