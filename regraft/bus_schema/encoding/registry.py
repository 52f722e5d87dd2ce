"""The message types that this process knows: name and version to class.

A package of one's own registers its types by importing the module that defines them; ``message`` does the rest.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.compiled import Convert, compile_pack, compile_unpack
from regraft.bus_schema.encoding.records import RecordShape, holds_tail, record_shape
from regraft.bus_schema.encoding.shapes import JsonSchema
from regraft.bus_schema.errors import BadType

TYPE_NAME = re.compile(r"[a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*")

T = TypeVar("T")


@dataclass(frozen=True)
class MessageType:
    """A registered type: ``package/Name``, its version, class and shape; ``tail`` names its large array field.

    ``encoding`` is the Zenoh encoding that its payloads carry: ``application/msgpack;package/Name@version``.
    """

    name: str
    version: int
    cls: type
    shape: RecordShape
    tail: str | None
    encoding: str

    # Compiling takes a millisecond a type, and a process uses a fraction of the types that it imports.

    @cached_property
    def pack(self) -> Convert:
        """The function that does what the shape's ``pack`` does, faster."""
        return compile_pack(self.cls)

    @cached_property
    def unpack(self) -> Convert:
        """The function that does what the shape's ``unpack`` does, faster."""
        return compile_unpack(self.cls)

    def compile(self) -> tuple[Convert, Convert]:
        """Compile ``pack`` and ``unpack`` before they are used, and return them."""
        return self.pack, self.unpack

    def json_schema(self) -> JsonSchema:
        """Return the JSON Schema (2020-12) of the type's plain data."""
        return {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "$id": f"regraft:{self.name}@{self.version}",
            **self.shape.json_schema(),
        }


_types: dict[str, MessageType] = {}
_by_class: dict[type, MessageType] = {}
_by_encoding: dict[str, MessageType] = {}


def message(name: str, version: int = 1) -> Callable[[type[T]], type[T]]:
    """Register the decorated dataclass as the message type ``name`` (``package/Name``).

    Raises:
        BadType: the name is ill-formed or another class's, the class has another name, or a field cannot travel.
    """

    def register(cls: type[T]) -> type[T]:
        if not TYPE_NAME.fullmatch(name):
            raise BadType(f"{name!r} must look like 'package/TypeName'")
        taken = _types.get(name)
        if taken and (taken.cls.__module__, taken.cls.__qualname__) != (cls.__module__, cls.__qualname__):
            raise BadType(f"{name!r} is already {taken.cls.__module__}.{taken.cls.__qualname__}")
        if cls in _by_class and _by_class[cls].name != name:
            raise BadType(f"{cls.__qualname__} is already registered as {_by_class[cls].name!r}")
        described: Any = cls
        shape = record_shape(described)
        tails = [field for field, s in shape.fields if isinstance(s, ArrayShape) and s.layout.tail]
        if len(tails) > 1:
            raise BadType(f"{cls.__qualname__} has {len(tails)} tail arrays, at most one can be a tail")
        inner = [field for field, s in shape.fields if not isinstance(s, ArrayShape) and holds_tail(s)]
        if inner:
            raise BadType(f"{cls.__qualname__}.{inner[0]} holds a tail array, which only a message itself can have")
        media = "application/x-msgpack-tail" if tails else "application/msgpack"
        registered = MessageType(
            name,
            version,
            cls,
            shape,
            tails[0] if tails else None,
            f"{media};{name}@{version}",
        )
        _types[name] = registered
        _by_class[cls] = _by_encoding[registered.encoding] = registered
        return cls

    return register


def type_of(cls: type) -> MessageType:
    """Return the registration of a message class; raises BadType if it has none."""
    try:
        return _by_class[cls]
    except KeyError:
        raise BadType(f"{cls.__qualname__} is not a message: decorate it with @message('package/Name')") from None


def type_named(name: str) -> MessageType:
    """Return the type registered as ``name``; raises BadType if this process does not know it."""
    try:
        return _types[name]
    except KeyError:
        raise BadType(f"no message type {name!r} is known here; known: {', '.join(sorted(_types))}") from None


def type_encoded(encoding: str) -> MessageType | None:
    """Return the type whose payloads carry this Zenoh encoding, None if this process knows none."""
    return _by_encoding.get(encoding)


def known_types() -> tuple[MessageType, ...]:
    """Return all registered types, by name."""
    return tuple(_types[name] for name in sorted(_types))
