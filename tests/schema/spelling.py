"""How docs/protocol.md spells a message type: one line per type."""

from __future__ import annotations

from collections.abc import Callable
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

USUAL_TEXT = TextShape().longest


def line_of(kind: MessageType) -> str:
    """Return the line that describes a type."""
    fields = (f"{name}{'?' if name in kind.shape.optional else ''}: {spelled(s)}" for name, s in kind.shape.fields)
    tail = " (with a tail)" if kind.tail else ""
    return f"- `{kind.name}@{kind.version}`{tail} — {'; '.join(fields)}"


def spelled(shape: Shape) -> str:
    """Return the words for a shape."""
    return WORDS[type(shape)](shape)


def _number(word: str, shape: FloatShape | IntShape) -> str:
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
    TextShape: lambda shape: "text" if shape.longest == USUAL_TEXT else f"text of at most {shape.longest}",
    BytesShape: lambda _: "bytes",
    EnumShape: lambda shape: " | ".join(f'"{member.value}"' for member in shape.members),
    TupleShape: lambda shape: f"list of ({spelled(shape.item)})",
    MapShape: lambda shape: f"map of ({spelled(shape.item)})",
    OptionalShape: lambda shape: f"{spelled(shape.item)}, or null",
    PlainShape: lambda _: "any",
    ArrayShape: lambda shape: f"array of {shape.layout.dtype} {list(shape.layout.shape)}",
    RecordShape: _record,
    ShorthandShape: lambda shape: f"{_record(shape.record)}, or text",
    UnionShape: lambda shape: "one of " + ", ".join(shape.members),
}
