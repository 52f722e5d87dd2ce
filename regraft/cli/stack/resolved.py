"""A stack as one document: all files together, the topic of every port, and absolute paths."""

from __future__ import annotations

from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.stack.stack import Stack
from regraft.stack.yaml.nodes import Location, Node


def resolved(stack: Stack) -> Node:
    """Return the document of a stack; a file of it gives the same architecture, wherever the file is.

    A value that no file has is from the class of the component, which is named as its origin.
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
        parts["modes"] = _like(stack.architecture.modes, modes, modes.location)
    return Node(parts, document.location)


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
    usual = Location(spec.cls or "its ports")
    fields = (("parameters", spec.parameters), ("connect", spec.connections), ("services", spec.services))
    for key, values in fields:
        if values or key in parts:
            parts[key] = _like(values, parts.get(key, Node({}, usual)), usual)
    parameters = parts.get("parameters")
    if speed is not None and parameters is not None and isinstance(parameters.value, dict):
        moved = {"speed": Node(spec.parameters["speed"], speed.location)} if "speed" in spec.parameters else {}
        parts["parameters"] = Node(parameters.value | moved, parameters.location)
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
