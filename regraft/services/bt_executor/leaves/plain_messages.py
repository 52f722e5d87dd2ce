"""Messages of any type as JSON in a tree's XML, so that a new service needs no Python."""

from __future__ import annotations

import json
import re
from importlib import import_module
from typing import Any, Final

from behavior_tree import Blackboard
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import MessageType, type_named, type_of
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.process.modules import CannotImport, imported

_PREFIX: Final = "json:"
_REFERENCE: Final = re.compile(r"\{(@?\w+)\}")
_PACKAGES: Final = ("geometry", "maps", "mission", "navigation", "perception", "power", "sensors", "world")


def message_type(name: str) -> MessageType:
    """Return a message type by its name, ``package/Name``, or by the place of its class, ``module:Class``.

    Raises:
        ValueError: there is no such type.
    """
    try:
        if ":" not in name:
            for module in _PACKAGES:
                import_module(f"regraft.bus_schema.messages.{module}")
            return type_named(name)
        module_name, _, class_name = name.partition(":")
        return type_of(getattr(imported(module_name), class_name))
    except (BadType, CannotImport, AttributeError) as error:
        raise ValueError(f"'{name}' is no message type: {error}") from error


def read_json(text: str) -> PlainValue:
    """Return plain data from JSON text with or without ``json:`` before it; raises ValueError."""
    try:
        return json.loads(text.strip().removeprefix(_PREFIX) or "{}")
    except json.JSONDecodeError as error:
        raise ValueError(f"'{text}' is not JSON: {error}") from error
    except RecursionError:
        raise ValueError("the JSON is nested too deeply") from None


def filled(plain: PlainValue, board: Blackboard) -> PlainValue:
    """Return plain data in which every text ``{key}`` is replaced by the value of that blackboard entry.

    Raises:
        BlackboardError: there is no such entry, or it is empty.
    """
    if isinstance(plain, dict):
        return {key: filled(value, board) for key, value in plain.items()}
    if isinstance(plain, list):
        return [filled(item, board) for item in plain]
    found = _REFERENCE.fullmatch(plain) if isinstance(plain, str) else None
    return as_plain(board.get(found.group(1))) if found else plain


def has_references(plain: PlainValue) -> bool:
    """Return whether plain data holds texts that refer to blackboard entries."""
    if isinstance(plain, dict):
        return any(has_references(value) for value in plain.values())
    if isinstance(plain, list):
        return any(has_references(item) for item in plain)
    return isinstance(plain, str) and _REFERENCE.fullmatch(plain) is not None


def as_plain(value: Any) -> PlainValue:
    """Return a blackboard value as plain data; messages become maps."""
    if isinstance(value, list | tuple):
        return [as_plain(item) for item in value]
    try:
        return codec.to_plain(value)
    except BadType:
        return value


def make_message(plain: PlainValue, kind: MessageType) -> object:
    """Return the message that plain data represents; raises ValueError, which states which field is wrong."""
    try:
        return codec.from_plain(plain, kind.cls)
    except BadMessage as error:
        raise ValueError(f"{kind.name} {error}") from error


def field_of(plain: PlainValue, path: str) -> PlainValue:
    """Return a field by its dotted path, such as ``best.position.x`` or ``goals.0.name``.

    Raises:
        ValueError: there is no such field; names those that there are.
    """
    value = plain
    for step in path.split("."):
        if isinstance(value, dict) and step in value:
            value = value[step]
        elif isinstance(value, list) and step.isdigit() and int(step) < len(value):
            value = value[int(step)]
        else:
            there = ", ".join(value) if isinstance(value, dict) else type(value).__name__
            raise ValueError(f"there is no field '{step}' of '{path}'; there is: {there}")
    return value
