"""Values that do not fit a shape, and where in a message's plain data they can be put."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import msgpack
import numpy as np

from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.records import RecordShape, ShorthandShape, UnionShape
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

NAMELESS_MAP: dict[Any, Any] = {1: 1}


@dataclass(frozen=True, slots=True)
class Place:
    """A value in a tree of plain data: the map or list that holds it, its key there, and its shape."""

    holder: Any
    key: Any
    shape: Shape


def misfits(shape: Shape) -> list[Any]:
    """Return values that a shape must refuse, from a publisher and off the wire alike."""
    return BUILDERS[type(shape)](shape)


def _out_of_bounds(shape: FloatShape | IntShape, step: float) -> list[Any]:
    below = [] if shape.minimum is None else [type(step)(shape.minimum - step)]
    above = [] if shape.maximum is None else [type(step)(shape.maximum + step)]
    return below + above


def _not_floats(shape: FloatShape) -> list[Any]:
    infinite = [] if shape.infinite else [math.inf, -math.inf]
    return ["1.0", None, True, [], math.nan, *infinite, *_out_of_bounds(shape, 0.001)]


def _not_ints(shape: IntShape) -> list[Any]:
    return ["1", None, True, 1.0, [], *_out_of_bounds(shape, 1)]


def _not_lists(shape: TupleShape) -> list[Any]:
    return [None, "ab", 1, {}, *([value] for value in BUILDERS[type(shape.item)](shape.item))]


def _not_maps(shape: MapShape) -> list[Any]:
    return [
        None,
        [],
        "a",
        1,
        NAMELESS_MAP,
        *({"k": value} for value in BUILDERS[type(shape.item)](shape.item)),
    ]


def _not_plain(_: PlainShape) -> list[Any]:
    deep: list[Any] = []
    for _level in range(20):
        deep = [deep]
    return [math.nan, [math.nan], {"a": math.nan}, deep, NAMELESS_MAP, msgpack.Timestamp(1)]


def _not_arrays(shape: ArrayShape) -> list[Any]:
    return [None, [], b"", 1, {"dtype": shape.layout.dtype}]


def _not_unions(shape: UnionShape) -> list[Any]:
    return [None, [], {}, {shape.key: "no such member"}, {shape.key: 1}]


BUILDERS: dict[type, Callable[[Any], list[Any]]] = {
    FloatShape: _not_floats,
    IntShape: _not_ints,
    BoolShape: lambda _: [0, 1, "true", None],
    TextShape: lambda shape: [1, None, b"text", ["a"], *([] if shape.cut else ["x" * (shape.longest + 1)])],
    BytesShape: lambda _: ["text", None, 1],
    EnumShape: lambda _: ["no such member", 1, None, []],
    TupleShape: _not_lists,
    MapShape: _not_maps,
    OptionalShape: lambda shape: [v for v in BUILDERS[type(shape.item)](shape.item) if v is not None],
    PlainShape: _not_plain,
    ArrayShape: _not_arrays,
    RecordShape: lambda _: [None, [], 1, "record", {"no such field": 1}],
    ShorthandShape: lambda _: [None, [], 1, {}, {"no such field": 1}],
    UnionShape: _not_unions,
}


def wrong_arrays(shape: ArrayShape) -> list[np.ndarray[Any, Any]]:
    """Return arrays of another dtype, another rank, and other fixed lengths than a shape has."""
    dimensions = [2 if length is None else length for length in shape.layout.shape]
    dtype = np.dtype(shape.layout.dtype)
    other = np.dtype("<f8") if dtype.itemsize != 8 else np.dtype("<f4")
    wrong = [
        np.zeros(dimensions, other),
        np.zeros([*dimensions, 1], dtype),
        np.zeros(dimensions, dtype.newbyteorder(">")),
    ]
    if any(length is not None for length in shape.layout.shape):
        wrong.append(np.zeros([length + 1 for length in dimensions], dtype))
    return [array for array in wrong if array.dtype != dtype or list(array.shape) != dimensions]


def places(holder: Any, key: Any, shape: Shape) -> Iterator[Place]:
    """Yield every value below ``holder[key]`` whose shape is known."""
    yield Place(holder, key, shape)
    plain = holder[key]
    if isinstance(shape, OptionalShape):
        if plain is None:
            return
        shape = shape.item
    if isinstance(shape, TupleShape):
        for index in range(len(plain)):
            yield from places(plain, index, shape.item)
    elif isinstance(shape, MapShape):
        for name in plain:
            yield from places(plain, name, shape.item)
    elif isinstance(shape, UnionShape):
        shape = shape.members[plain[shape.key]]
        yield Place(holder, key, shape)
    if isinstance(shape, RecordShape):
        for name, inner in shape.fields:
            yield from places(plain, name, inner)
