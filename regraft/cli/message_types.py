"""Message types by name: those of the schema, and those that a system's own modules define."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import bus_schema
from bus_schema import codec
from bus_schema.annotations import PlainValue
from bus_schema.errors import BadMessage, BadType
from bus_schema.registry import MessageType, known_types, type_named
from bus_schema.suggestions import instead_of
from regraft.cli.group import BadInput
from regraft.process import NoSuchClass, load_class
from regraft.stack.classes import look_in


def know_schema() -> None:
    """Make all message types of the schema known."""
    for module in pkgutil.walk_packages(bus_schema.__path__, f"{bus_schema.__name__}."):
        importlib.import_module(module.name)


def named(name: str, classes: Iterable[str] = (), folder: Path | None = None) -> MessageType:
    """Return a message type; if need be, ``classes`` are loaded until one's modules know it.

    ``folder`` is where a stack's own modules are.

    Raises:
        BadInput: no such type is known here.
    """
    know_schema()
    found = _known(name)
    if folder is not None:
        look_in(folder)
    for path in classes:
        if found is not None:
            break
        # A class that cannot be loaded here may still run elsewhere; another one may know the type.
        with suppress(NoSuchClass):
            load_class(path)
        found = _known(name)
    if found is None:
        hint = instead_of(name, (kind.name for kind in known_types()))
        raise BadInput(f"the message type {name!r} is not known here; {hint}")
    return found


def _known(name: str) -> MessageType | None:
    try:
        return type_named(name)
    except BadType:
        return None


def message_of(kind: MessageType, body: PlainValue) -> object:
    """Return the message that a typed body stands for, an absent one for no fields; raises BadInput."""
    try:
        made: object = codec.from_plain({} if body is None else body, kind.cls)
    except BadMessage as error:
        raise BadInput(f"the body is no {kind.name}: {error}; see 'regraft types {kind.name}'") from None
    return made
