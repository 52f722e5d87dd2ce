"""How docs/protocol.md spells a message type: one line per type."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any

from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.records import RecordShape, ShorthandShape, UnionShape
from regraft.bus_schema.encoding.registry import MessageType, known_types
from regraft.bus_schema.encoding.shapes import (
    BoolShape,
    BytesShape,
    EnumShape,
    FloatShape,
    IntShape,
    MapShape,
    OptionalShape,
    PlainShape,
    Shape,
    TextShape,
    TupleShape,
)
from regraft.bus_schema.model.lifecycle import State

USUAL_TEXT = TextShape().longest
NAMED = {State: "State"}
"""Enumerations that the page spells once."""


def line_of(kind: MessageType) -> str:
    """Return the line that describes a type."""
    fields = (f"{name}{'?' if name in kind.shape.optional else ''}: {spelled(s)}" for name, s in kind.shape.fields)
    tail = " (with a tail)" if kind.tail else ""
    return f"- `{kind.name}@{kind.version}`{tail}: {'; '.join(fields)}"


def spelled(shape: Shape) -> str:
    """Return the words for a shape."""
    return WORDS[type(shape)](shape)


def members_of(members: type[Enum]) -> str:
    """Return the members of an enumeration."""
    return "|".join(f'"{member.value}"' for member in members)


def _number(word: str, shape: FloatShape | IntShape) -> str:
    if word == "integer" and (shape.minimum, shape.maximum, shape.unit or "") == (0, None, ""):
        return "count"
    if word == "number" and (shape.minimum, shape.maximum, shape.unit) == (None, None, "s"):
        return "seconds"
    low = "" if shape.minimum is None else f"{shape.minimum:g}"
    high = "" if shape.maximum is None else f"{shape.maximum:g}"
    bounds = f" {low}..{high}" if low or high else ""
    return word + bounds + (f" [{shape.unit}]" if shape.unit else "")


def _record(shape: RecordShape) -> str:
    known = {kind.cls: kind.name for kind in known_types()}
    return f"`{known.get(shape.cls, shape.cls.__name__)}`"


WORDS: dict[type, Callable[[Any], str]] = {
    FloatShape: lambda shape: _number("number", shape),
    IntShape: lambda shape: _number("integer", shape),
    BoolShape: lambda _: "boolean",
    TextShape: lambda shape: "text" if shape.longest == USUAL_TEXT else f"text({shape.longest})",
    BytesShape: lambda _: "bytes",
    EnumShape: lambda shape: NAMED.get(shape.members) or members_of(shape.members),
    TupleShape: lambda shape: f"list({spelled(shape.item)})",
    MapShape: lambda shape: f"map({spelled(shape.item)})",
    OptionalShape: lambda shape: f"{spelled(shape.item)}|null",
    PlainShape: lambda _: "any",
    ArrayShape: lambda shape: f"array of {shape.layout.dtype} {list(shape.layout.shape)}",
    RecordShape: _record,
    ShorthandShape: lambda shape: f"{_record(shape.record)}|text",
    UnionShape: lambda shape: "one of " + ", ".join(shape.members),
}
