"""A stack as one document: all files together, the topic of every port, and absolute paths."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import Add, EnterMode, Swap
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_deciders import deciders
from regraft.stack.classes import taken_values
from regraft.stack.stack import Stack
from regraft.stack.yaml.nodes import Location, Node


def resolved(stack: Stack) -> Node:
    """Return the document of a stack; a file of it gives the same architecture, where its modules can be imported.

    They can be wherever the file is, unless they are in `module_folders`.
    Rules of files of system_modes that nobody enforces are left out. A value that no file has is from the class of the
    component, which is named as its origin.
    """
    document = stack.document
    assert isinstance(document.value, dict)
    parts = dict(document.value)
    # Loading makes it a parameter of the source of time.
    speed = parts.pop("speed", None)
    components = parts.get("components")
    if components is not None and isinstance(components.value, dict):
        specs = stack.architecture.components
        whole = {name: _component(node, specs[name], speed) for name, node in components.value.items()}
        parts["components"] = Node(whole, components.location)
    modes = parts.get("modes")
    if modes is not None:
        parts["modes"] = _like(_folded(stack), modes, modes.location)
        rules = {rule.name: _rule(rule) for rule in stack.architecture.mode_rules}
        if rules and deciders(
            stack.architecture.components.values()
        ):  # those of files, which nobody has to enforce, are rules as any here
            usual = Location(str(modes.value)) if isinstance(modes.value, str) else modes.location
            parts["rules"] = _like(rules, parts.get("rules", Node({}, usual)), usual)
    return Node(parts, document.location)


def module_folders(stack: Stack) -> tuple[Path, ...]:
    """Return those folders of a stack's files in which this process has found modules of the stack."""
    found: set[Path] = set()
    for name, module in list(sys.modules.items()):
        if "." not in name:
            of_package = [str(path) for path in getattr(module, "__path__", ())]
            found.update(Path(path).parent for path in of_package or filter(None, [getattr(module, "__file__", None)]))
    return tuple(folder for folder in stack.folders if folder in found)


def _folded(stack: Stack) -> dict[str, PlainValue]:
    """Return the changes of each mode, in which modes that it enters stand for their changes.

    Changes have the values that classes take from robots: the document has no robots.
    """
    architecture = stack.architecture
    modes: dict[str, list[PlainValue]] = {name: list(_items(each)) for name, each in architecture.modes.items()}
    found: dict[str, PlainValue] = {}
    for name, changes in modes.items():
        left, folded = list(architecture.mode_parts.get(name, ())), list[PlainValue]()
        while changes or left:
            inner = modes[left[0]] if left else []
            if left and changes[: len(inner)] == inner:
                folded.append({"change": EnterMode.change, "mode": left.pop(0)})
                changes = changes[len(inner) :]
            else:
                folded.append(_of_robot(changes[0], stack))
                changes = changes[1:]
        found[name] = folded
    return found


def _of_robot(change: PlainValue, stack: Stack) -> PlainValue:
    """Return a change with the parameters that the class which it brings takes from its component's robot."""
    name = change.get("component", "")
    old = stack.architecture.components.get(name)
    if change["change"] == Add.change:
        spec = change["spec"]
        taken = taken_values(name, spec.get("class", ""), stack.references)
        return {**change, "spec": {**spec, "parameters": taken | spec.get("parameters", {})}} if taken else change
    if change["change"] != Swap.change or old is None:
        return change
    # A successor keeps what the component has by then.
    brought = taken_values(name, change.get("class", ""), stack.references)
    taken = {key: value for key, value in brought.items() if key not in old.parameters}
    return {**change, "parameters": taken | change.get("parameters", {})} if taken else change


def _items(value: PlainValue) -> list[PlainValue]:
    assert isinstance(value, list | tuple)
    return list(value)


def _rule(rule: ModeRule) -> dict[str, PlainValue]:
    """Return a rule as a stack file has it."""
    given: dict[str, PlainValue] = {"when": rule.when, "mode": rule.mode, "from": list(rule.start)}
    given |= {"settle": rule.settle, "dwell": rule.dwell, "because": rule.because}
    return {key: value for key, value in given.items() if value not in (None, "", [])}


def with_origins(node: Node) -> Any:
    """Return a document as plain data, each scalar as its ``value`` and the place that it is ``from``."""
    if isinstance(node.value, dict):
        return {key: with_origins(part) for key, part in node.value.items()}
    if isinstance(node.value, tuple):
        return [with_origins(part) for part in node.value]
    return {"value": node.value, "from": str(node.location)}


def _component(node: Node, spec: ComponentSpec, speed: Node | None) -> Node:
    assert isinstance(node.value, dict)
    parts = dict(node.value)
    given = parts.get("parameters")
    has_own = given is not None and isinstance(given.value, dict) and "speed" in given.value
    usual = Location(spec.cls or "its ports")
    fields = (("parameters", spec.parameters), ("connect", spec.connections), ("services", spec.services))
    for key, values in fields:
        if values or key in parts:
            parts[key] = _like(values, parts.get(key, Node({}, usual)), usual)
    if "command" in parts:
        parts["command"] = _like(spec.command, parts["command"], usual)
    if speed is not None and "speed" in spec.parameters and not has_own:
        whole = parts["parameters"]
        assert isinstance(whole.value, dict)
        moved = {"speed": Node(spec.parameters["speed"], speed.location)}
        parts["parameters"] = Node(whole.value | moved, whole.location)
    return Node(parts, node.location)


def _like(value: PlainValue, node: Node | None, usual: Location) -> Node:
    """Return plain data with the locations of a node where that has them, the usual one elsewhere."""
    location = node.location if node is not None else usual
    if isinstance(value, dict):
        known = node.value if node is not None and isinstance(node.value, dict) else {}
        return Node({key: _like(part, known.get(key), usual) for key, part in value.items()}, location)
    if isinstance(value, list | tuple):
        items = node.value if node is not None and isinstance(node.value, tuple) else ()
        found = (_like(part, items[i] if i < len(items) else None, location) for i, part in enumerate(value))
        return Node(tuple(found), location)
    return Node(value, location)
