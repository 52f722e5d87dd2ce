"""Checks what can be read of a message type, before any message has come."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.reading import NEEDED, Reading, Reduce, is_index
from regraft.bus_schema.encoding.records import RecordShape
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
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import near

NUMBERS = (FloatShape, IntShape)
SCALARS = (FloatShape, IntShape, BoolShape, TextShape, EnumShape)
WORDS: dict[type, str] = {
    FloatShape: "a number",
    IntShape: "a number",
    BoolShape: "true or false",
    TextShape: "text",
    EnumShape: "text",
    BytesShape: "bytes",
    TupleShape: "a list",
    MapShape: "a map",
    ArrayShape: "an array",
}


class ValueKind(Enum):
    """The kinds of values that are read and computed, in words."""

    TRUTH = "true or false"
    NUMBER = "a number"
    TEXT = "a text"
    LIST = "a list"


KINDS: dict[type, ValueKind] = {
    FloatShape: ValueKind.NUMBER,
    IntShape: ValueKind.NUMBER,
    BoolShape: ValueKind.TRUTH,
    TextShape: ValueKind.TEXT,
    EnumShape: ValueKind.TEXT,
    TupleShape: ValueKind.LIST,
}


def reading_kind(record: RecordShape | None, reading: Reading) -> ValueKind | None:
    """Return the kind of the value that is read from messages of a shape; None if it may be any.

    Without a shape, it is known by the reduction alone. Raises BadMessage as `reading_problem` returns it.
    """
    if reading.reduce is not None:
        kind: ValueKind | None = ValueKind.TEXT if reading.reduce is Reduce.TEXT else ValueKind.NUMBER
    else:
        shape = record and _at(record, reading.field.split("."), record.cls.__name__)
        kind = KINDS.get(type(shape))
    return None if kind is ValueKind.TEXT and reading.if_none is not None else kind


def reading_texts(record: RecordShape, reading: Reading) -> tuple[str, ...]:
    """Return all texts that can be read from a field with few of them, none for any other; raises BadMessage."""
    shape = _at(record, reading.field.split("."), record.cls.__name__)
    if not isinstance(shape, EnumShape) or reading.reduce not in (None, Reduce.TEXT):
        return ()
    return tuple(str(member.value) for member in shape.members)


def reading_problem(record: RecordShape, reading: Reading) -> str | None:
    """Return why messages of this shape cannot be read so, and how they can; None if they can."""
    try:
        shape = _at(record, reading.field.split("."), record.cls.__name__)
    except BadMessage as error:
        return str(error)
    if isinstance(shape, PlainShape) or _FITS[reading.reduce](shape):
        return None
    made = f" for {reading.reduce.value!r}" if reading.reduce else ""
    hint = f"; it has: {_names(shape)}" if isinstance(shape, RecordShape) else ""
    return f"{record.cls.__name__}.{reading.field} is {_word(shape)}, must be {NEEDED[reading.reduce]}{made}{hint}"


def _at(shape: Shape, path: list[str], where: str) -> Shape:
    """Return the shape that a path leads to; that of any part of plain data is plain data."""
    if isinstance(shape, OptionalShape):
        return _at(shape.item, path, where)
    if not path or isinstance(shape, PlainShape):
        return shape
    if isinstance(shape, TupleShape) and not is_index(path[0]):
        return TupleShape(_at(shape.item, path, where))
    inner, used = _part(shape, path)
    if inner is None:
        has = f"it has: {_names(shape)}" if isinstance(shape, RecordShape) else f"it is {_word(shape)}"
        meant = near(path[0], [name for name, _ in shape.fields]) if isinstance(shape, RecordShape) else None
        hint = f"; did you mean {meant!r}?" if meant else ""
        raise BadMessage(f"{where} has no field {path[0]!r}; {has}{hint}")
    return _at(inner, path[used:], ".".join([where, *path[:used]]))


def _part(shape: Shape, path: list[str]) -> tuple[Shape | None, int]:
    """Return the shape of a part, None if there is none, and how much of the path leads to it."""
    if isinstance(shape, RecordShape):
        return dict(shape.fields).get(path[0]), 1
    if isinstance(shape, MapShape | TupleShape):
        return shape.item, 1
    if isinstance(shape, ArrayShape) and len(path) == len(shape.layout.shape) and all(map(is_index, path)):
        return FloatShape(infinite=True), len(path)
    return None, 0


def _names(shape: RecordShape) -> str:
    return ", ".join(name for name, _ in shape.fields) or "none"


def _word(shape: Shape) -> str:
    return f"a {shape.cls.__name__}" if isinstance(shape, RecordShape) else WORDS.get(type(shape), "one of several")


def _is_list_of(shape: Shape, items: tuple[type, ...]) -> bool:
    return isinstance(shape, TupleShape) and _is_one_of(shape.item, items)


def _is_one_of(shape: Shape, kinds: tuple[type, ...]) -> bool:
    inner = shape.item if isinstance(shape, OptionalShape) else shape
    return isinstance(inner, (*kinds, PlainShape))


def _is_value(shape: Shape) -> bool:
    return isinstance(shape, SCALARS) or _is_list_of(shape, SCALARS)


def _is_vector(shape: Shape) -> bool:
    if isinstance(shape, RecordShape):
        return bool(shape.fields) and all(isinstance(inner, NUMBERS) for _, inner in shape.fields)
    return isinstance(shape, ArrayShape) or _is_list_of(shape, NUMBERS)


def _is_many(shape: Shape) -> bool:
    if isinstance(shape, MapShape):
        return _is_one_of(shape.item, NUMBERS)
    return isinstance(shape, ArrayShape) or _is_list_of(shape, NUMBERS)


_FITS: dict[Reduce | None, Callable[[Shape], bool]] = {
    None: _is_value,
    Reduce.ABS: lambda shape: isinstance(shape, NUMBERS),
    Reduce.NORM: _is_vector,
    Reduce.MIN: _is_many,
    Reduce.MAX: _is_many,
    Reduce.MEAN: _is_many,
    Reduce.LENGTH: lambda shape: isinstance(shape, TupleShape | MapShape | ArrayShape | TextShape),
    Reduce.TEXT: _is_value,
}
