"""The message types that topics may carry, and the nearest one for any other name."""

from __future__ import annotations

import importlib
import pkgutil

from regraft import bus_schema
from regraft.bus_schema.encoding.registry import MessageType, known_types
from regraft.bus_schema.suggestions import instead_of

PROTOCOL = frozenset(
    {
        "regraft.bus_schema.model.description",
        "regraft.bus_schema.model.qualities.estimates",
        "regraft.bus_schema.messages.protocol.clock",
        "regraft.bus_schema.messages.protocol.control",
        "regraft.bus_schema.messages.protocol.handover",
        "regraft.bus_schema.messages.protocol.host",
        "regraft.bus_schema.messages.protocol.joining",
        "regraft.bus_schema.messages.management.manager",
        "regraft.bus_schema.messages.protocol.requests",
        "regraft.bus_schema.encoding.reading",
        "regraft.runtime.core.assignment",
    }
)
"""The modules of what components, hosts and the clock ask each other: their types travel on no topic."""


def know_schema() -> None:
    """Make all message types of the schema known."""
    for module in pkgutil.walk_packages(bus_schema.__path__, f"{bus_schema.__name__}."):
        importlib.import_module(module.name)


def is_type(name: str) -> bool:
    """Return whether a message type of that name is known: those of the schema are, imported or not."""
    if name in {kind.name for kind in known_types()}:
        return True
    know_schema()
    return name in {kind.name for kind in known_types()}


def instead_of_type(name: str) -> str:
    """Return which message type of a topic may have been meant by ``name``, which may be its class."""
    kinds = {kind.name: kind for kind in known_types() if kind.cls.__module__ not in PROTOCOL}
    for kind in kinds.values():
        if name in _classes(kind):
            return f"did you mean {kind.name!r}?"
    if ":" in name:
        return "a topic has a message type such as 'regraft/Twist', no class"
    return instead_of(name, kinds)


def _classes(kind: MessageType) -> tuple[str, str, str]:
    module, name = kind.cls.__module__, kind.cls.__qualname__
    return f"{module}:{name}", f"{module}.{name}", name
