"""How one kind of value is checked, packed and described: a shape per kind, composed into records by ``records``.

A shape turns a Python value into plain data for MessagePack (``pack``) and back (``unpack``). Both check: a bad value
is refused by its publisher already, and again by its receivers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

import msgpack
import numpy as np

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import near

JsonSchema = dict[str, Any]

MAX_PLAIN_DEPTH = 16
INT_RANGE = range(-(2**63), 2**64)


class Shape(Protocol):
    """Checks, packs and describes one kind of value."""

    def pack(self, value: Any) -> Any:
        """Return ``value`` as plain data; raises BadMessage."""

    def unpack(self, plain: Any) -> Any:
        """Return the value of the plain data; raises BadMessage."""

    def json_schema(self) -> JsonSchema:
        """Describe the plain data as JSON Schema 2020-12."""


def _name(value: object) -> str:
    return type(value).__name__


def _check_unicode(text: str) -> None:
    """Refuse lone surrogates, which no encoding carries."""
    if text.isascii():
        return
    try:
        text.encode()
    except UnicodeEncodeError:
        raise BadMessage("is not valid Unicode text") from None


def _has_ascii_keys(plain: dict[Any, Any]) -> bool:
    try:
        return all(map(str.isascii, plain))
    except TypeError:
        return False


@dataclass(frozen=True, slots=True)
class FloatShape:
    """A float, never NaN, infinite only where that is allowed."""

    minimum: float | None = None
    maximum: float | None = None
    infinite: bool = False
    unit: str | None = None

    def pack(self, value: Any) -> float:
        """Return a finite float within the bounds; takes ints and numpy floats too."""
        if type(value) is not float:
            if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
                raise BadMessage(f"is {_name(value)}, must be a number")
            try:
                value = float(value)
            except OverflowError:
                raise BadMessage("is an integer too large for a float") from None
        if not -math.inf < value < math.inf and not (self.infinite and value in (math.inf, -math.inf)):
            raise BadMessage(f"is {value}, must be a {'number' if self.infinite else 'finite number'}")
        if self.minimum is not None and value < self.minimum:
            raise BadMessage(f"is {value}, must be at least {self.minimum}")
        if self.maximum is not None and value > self.maximum:
            raise BadMessage(f"is {value}, must be at most {self.maximum}")
        number: float = value
        return number

    unpack = pack

    def json_schema(self) -> JsonSchema:
        """Return a ``number`` with bounds and ``x-unit``, with ``x-infinite`` where it may be infinite."""
        more = {"x-infinite": True} if self.infinite else {}
        return _bounded({"type": "number", **more}, self.minimum, self.maximum, self.unit)


@dataclass(frozen=True, slots=True)
class IntShape:
    """An integer that fits 64 bits."""

    minimum: float | None = None
    maximum: float | None = None
    unit: str | None = None

    def pack(self, value: Any) -> int:
        """Return an int within the bounds; takes numpy ints, refuses bool."""
        if type(value) is not int:
            if not isinstance(value, np.integer):
                raise BadMessage(f"is {_name(value)}, must be an integer")
            value = int(value)
        if value not in INT_RANGE:
            raise BadMessage("is an integer that does not fit 64 bits")
        if self.minimum is not None and value < self.minimum:
            raise BadMessage(f"is {value}, must be at least {self.minimum:g}")
        if self.maximum is not None and value > self.maximum:
            raise BadMessage(f"is {value}, must be at most {self.maximum:g}")
        number: int = value
        return number

    unpack = pack

    def json_schema(self) -> JsonSchema:
        """Return an ``integer`` with bounds and ``x-unit``."""
        return _bounded({"type": "integer"}, self.minimum, self.maximum, self.unit)


@dataclass(frozen=True, slots=True)
class BoolShape:
    """True or false."""

    def pack(self, value: Any) -> bool:
        """Return a bool; takes numpy bools."""
        if isinstance(value, bool | np.bool_):
            return bool(value)
        raise BadMessage(f"is {_name(value)}, must be true or false")

    unpack = pack

    def json_schema(self) -> JsonSchema:
        """Return ``boolean``."""
        return {"type": "boolean"}


CUT = " ..."
"""How a text ends that was cut."""


@dataclass(frozen=True, slots=True)
class TextShape:
    """Text of a bounded length; ``cut`` has a longer one cut when it is packed, ``unit`` is ``path`` for a file."""

    longest: int = 65_536
    cut: bool = False
    unit: str | None = None

    def pack(self, value: Any) -> str:
        """Return the text."""
        if self.cut and isinstance(value, str) and len(value) > self.longest:
            value = value[: self.longest - len(CUT)] + CUT
        return self.unpack(value)

    def unpack(self, value: Any) -> str:
        """Return the text."""
        if not isinstance(value, str):
            raise BadMessage(f"is {_name(value)}, must be text")
        if len(value) > self.longest:
            raise BadMessage(f"is {len(value)} characters long, must be at most {self.longest}")
        _check_unicode(value)
        return str.__str__(value)  # what a member of an enumeration of texts holds, not what it calls itself

    def json_schema(self) -> JsonSchema:
        """Return ``string``, with ``x-unit`` if it has one."""
        unit = {} if self.unit is None else {"x-unit": self.unit}
        return {"type": "string", "maxLength": self.longest, **unit}


@dataclass(frozen=True, slots=True)
class BytesShape:
    """Raw bytes."""

    def pack(self, value: Any) -> bytes:
        """Return the bytes."""
        if not isinstance(value, bytes | bytearray | memoryview):
            raise BadMessage(f"is {_name(value)}, must be bytes")
        return bytes(value)

    unpack = pack

    def json_schema(self) -> JsonSchema:
        """Return a base64 ``string``, as JSON views of messages show bytes."""
        return {"type": "string", "contentEncoding": "base64"}


@dataclass(frozen=True, slots=True)
class EnumShape:
    """A member of an enumeration of texts; its value travels. ``allowed`` are those that it may be."""

    members: type[Enum]
    allowed: tuple[Enum, ...]

    def pack(self, value: Any) -> str:
        """Return the member's value."""
        if not isinstance(value, self.members):
            raise BadMessage(f"is {_name(value)}, must be a {self.members.__name__}")
        return str(value.value)

    def unpack(self, plain: Any) -> Enum:
        """Return the member."""
        known = [str(member.value) for member in self.allowed]
        if not isinstance(plain, str):  # an array compares by each of its numbers
            raise BadMessage(f"is {_name(plain)}, must be one of: {', '.join(known)}")
        if plain in known:
            return self.allowed[known.index(plain)]
        meant = near(plain, known)
        hint = f"; did you mean {meant!r}?" if meant else ""
        raise BadMessage(f"is {plain!r}, must be one of: {', '.join(known)}{hint}")

    def json_schema(self) -> JsonSchema:
        """Return the values as ``enum``."""
        return {"enum": [member.value for member in self.allowed]}


@dataclass(frozen=True, slots=True)
class TupleShape:
    """Any number of equal things; a list on the wire, a tuple in Python."""

    item: Shape

    def pack(self, value: Any) -> list[Any]:
        """Return a list of packed items."""
        return [self._each(self.item.pack, index, item) for index, item in enumerate(self._listed(value))]

    def unpack(self, plain: Any) -> tuple[Any, ...]:
        """Return a tuple of unpacked items."""
        return tuple(self._each(self.item.unpack, index, item) for index, item in enumerate(self._listed(plain)))

    @staticmethod
    def _listed(value: Any) -> list[Any] | tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise BadMessage(f"is {_name(value)}, must be a list")
        return value

    @staticmethod
    def _each(convert: Any, index: int, item: Any) -> Any:
        try:
            return convert(item)
        except BadMessage as error:
            raise error.inside(str(index)) from None

    def json_schema(self) -> JsonSchema:
        """Return an ``array`` of the item's schema."""
        return {"type": "array", "items": self.item.json_schema()}


@dataclass(frozen=True, slots=True)
class MapShape:
    """A map from text to equal things."""

    item: Shape

    def pack(self, value: Any) -> dict[str, Any]:
        """Return a map of packed items."""
        return self._convert(self.item.pack, value)

    def unpack(self, plain: Any) -> dict[str, Any]:
        """Return a map of unpacked items."""
        return self._convert(self.item.unpack, plain)

    @staticmethod
    def _convert(convert: Any, value: Any) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise BadMessage(f"is {_name(value)}, must be a map")
        converted = {}
        for key, item in value.items():
            if not isinstance(key, str):
                raise BadMessage(f"has a key of type {_name(key)}, must be text")
            _check_unicode(key)
            try:
                converted[key] = convert(item)
            except BadMessage as error:
                raise error.inside(key) from None
        return converted

    def json_schema(self) -> JsonSchema:
        """Return an ``object`` with the item's schema for every property."""
        return {"type": "object", "additionalProperties": self.item.json_schema()}


@dataclass(frozen=True, slots=True)
class OptionalShape:
    """Something or nothing."""

    item: Shape

    def pack(self, value: Any) -> Any:
        """Return None or the packed item."""
        return None if value is None else self.item.pack(value)

    def unpack(self, plain: Any) -> Any:
        """Return None or the item."""
        return None if plain is None else self.item.unpack(plain)

    def json_schema(self) -> JsonSchema:
        """Return ``anyOf`` the item and null."""
        return {"anyOf": [self.item.json_schema(), {"type": "null"}]}


PLAIN_TEXT, PLAIN_INT, PLAIN_FLOAT = TextShape(2**24), IntShape(), FloatShape(infinite=True)
"""The types that the leaves of plain data may have."""


@dataclass(frozen=True, slots=True)
class PlainShape:
    """Any plain data: parameter values, snapshots, details of an event."""

    def pack(self, value: Any, depth: int = 0) -> Any:
        """Return a copy, checked down to its leaves."""
        kind = type(value)
        # Bodies of requests and replies come this way: what they mostly hold comes first, and needs no further call.
        if kind is str and value.isascii() and len(value) <= PLAIN_TEXT.longest:
            return value
        if value is None or kind is bool or kind is bytes or (kind is float and not math.isnan(value)):
            return value
        if depth < MAX_PLAIN_DEPTH:
            if kind is dict and _has_ascii_keys(value):
                return {key: self.pack(item, depth + 1) for key, item in value.items()}
            if kind is list:
                return [self.pack(item, depth + 1) for item in value]
        return self._walk(value, depth)

    unpack = pack

    def _walk(self, value: Any, depth: int) -> Any:
        if value is None or isinstance(value, bool | bytes):
            return value
        if isinstance(value, str):
            return PLAIN_TEXT.pack(value)
        if isinstance(value, int):
            return PLAIN_INT.pack(value)
        if isinstance(value, float):
            return PLAIN_FLOAT.pack(value)
        if depth >= MAX_PLAIN_DEPTH:
            raise BadMessage(f"is nested deeper than {MAX_PLAIN_DEPTH} levels")
        if isinstance(value, msgpack.ExtType):  # a tuple, too
            raise BadMessage("is an array as messages hold it, must be plain data: tolist() or tobytes() makes it that")
        if isinstance(value, list | tuple):
            return [self.pack(item, depth + 1) for item in value]
        if isinstance(value, Mapping):
            if not all(isinstance(key, str) for key in value):
                raise BadMessage("has a key that is not text")
            for key in value:
                _check_unicode(key)
            return {key: self.pack(item, depth + 1) for key, item in value.items()}
        raise BadMessage(f"is {_name(value)}, must be plain data (None, bool, int, float, text, bytes, list, map)")

    def json_schema(self) -> JsonSchema:
        """Return the schema that admits everything."""
        return {}


def _bounded(schema: JsonSchema, minimum: float | None, maximum: float | None, unit: str | None) -> JsonSchema:
    if minimum is not None:
        schema["minimum"] = minimum
    if maximum is not None:
        schema["maximum"] = maximum
    if unit is not None:
        schema["x-unit"] = unit
    return schema
