"""Which node types a mission may use: the engine's, ours, and other people's."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Collection, Iterable
from importlib.metadata import entry_points
from typing import Any, Final

from behavior_tree import Node, Registry, RegistryError
from behavior_tree.nav2 import register_nav2
from behavior_tree.nav2.leaves import register_nav2_conditions
from regraft.bus_schema.suggestions import near
from regraft.process.modules import CannotImport, after_failure, imported
from regraft.services.bt_executor.adaptation import ADAPT_DECORATORS
from regraft.services.bt_executor.adaptation.objective import ObjectiveDecorator
from regraft.services.bt_executor.leaves.adapt import Adapt
from regraft.services.bt_executor.leaves.charge import ChargeBattery
from regraft.services.bt_executor.leaves.context import LeafContext
from regraft.services.bt_executor.leaves.detect import DetectObject
from regraft.services.bt_executor.leaves.exploring import AskNextFrontier, KeepMap
from regraft.services.bt_executor.leaves.generic import CallAction, CallService
from regraft.services.bt_executor.leaves.goals import GetGoals, NextGoal, PutGoal, TakeGoal
from regraft.services.bt_executor.leaves.nav2 import NAV2_LEAVES
from regraft.services.bt_executor.leaves.navigate_to import NavigateToGoal
from regraft.services.bt_executor.leaves.say import Say
from regraft.services.bt_executor.leaves.wait_for_condition import WaitForCondition
from regraft.services.bt_executor.leaves.wait_for_topic import WaitForTopic
from regraft.services.bt_executor.quality.from_xml import PlainSystemQR, PlainTaskQR

NODE_TYPES: Final[dict[str, type[Node]]] = {
    "Adapt": Adapt,
    "CallAction": CallAction,
    "CallService": CallService,
    "Charge": ChargeBattery,
    "Detect": DetectObject,
    "GetGoals": GetGoals,
    "NavigateTo": NavigateToGoal,
    "NextFrontier": AskNextFrontier,
    "NextGoal": NextGoal,
    "Objective": ObjectiveDecorator,
    "PutGoal": PutGoal,
    "SaveMap": KeepMap,
    "Say": Say,
    "SystemLevelQR": PlainSystemQR,
    "TakeGoal": TakeGoal,
    "TaskLevelQR": PlainTaskQR,
    "WaitForCondition": WaitForCondition,
    "WaitForTopic": WaitForTopic,
    **{cls.__name__: cls for cls in ADAPT_DECORATORS},
}
"""Our leaves and decorators by their names in XML: a further one is a class and a line here."""

ENTRY_POINTS: Final = "regraft.tree_nodes"
"""The entry point group of node types from other packages: each is a class or a list of classes."""


def node_types(context: LeafContext, places: Iterable[str] = (), leave_out: Collection[str] = ()) -> Registry:
    """Return the engine's node types, Nav2's, ours, installed packages', and those at ``places`` (``module:name``).

    A class whose constructor takes ``context`` gets it. Of ours, those named in ``leave_out`` are left to others.

    Raises:
        RegistryError: a place leads nowhere or to no node type, or a name is taken.
    """
    registry = Registry()
    for type_id, node_class in NODE_TYPES.items():
        if type_id not in leave_out:
            _register(registry, node_class, context, type_id)
    for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name):
        for node_class in _found_at(entry.value):
            _register(registry, node_class, context)
    for place in places:
        for node_class in _found_at(place):
            _register(registry, node_class, context)
    # Last, so that somebody else's node of one of these names goes before Nav2's.
    register_nav2(registry)
    register_nav2_conditions(registry)
    for type_id, node_class in NAV2_LEAVES.items():
        if type_id not in registry.manifests and type_id not in leave_out:
            _register(registry, node_class, context, type_id)
    return registry


def _register(registry: Registry, node_class: type[Node], context: LeafContext, type_id: str = "") -> None:
    wants_context = "context" in inspect.signature(node_class).parameters
    arguments: dict[str, Any] = {"context": context} if wants_context else {}
    registry.register(node_class, type_id, **arguments)


def _found_at(place: str) -> list[type[Node]]:
    module, _, name = place.partition(":")
    try:
        found = getattr(imported(module), name)
    except (CannotImport, AttributeError) as error:
        hint = after_failure(module, error) or _instead_of(name, module) if isinstance(error, AttributeError) else ""
        raise RegistryError(f"node types at '{place}' (must be module:name): {error}{hint}") from error
    classes = list(found) if isinstance(found, list | tuple) else [found]
    for node_class in classes:
        if not (isinstance(node_class, type) and issubclass(node_class, Node)):
            raise RegistryError(f"'{place}' holds {node_class!r}, which is no node type")
    return classes


def _instead_of(name: str, module: str) -> str:
    """Report which name of a module may be meant, as the end of a sentence; empty if none is near."""
    meant = near(name, vars(sys.modules[module])) if module in sys.modules else None
    return f"; did you mean {meant!r}?" if meant else ""
