"""A type that is known by its JSON Schema alone takes and refuses what its class does, and packs the same bytes."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, replace
from enum import Enum
from typing import Annotated, Any

import numpy as np
import pytest

from regraft.bus_schema.annotations import Array, Bounds, Count, FloatArray, MayBeInfinite
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.records import RecordShape, ShorthandShape, UnionShape
from regraft.bus_schema.encoding.registry import MessageType, message, type_of
from regraft.bus_schema.encoding.shapes import (
    BytesShape,
    FloatShape,
    MapShape,
    OptionalShape,
    PlainShape,
    Shape,
    TupleShape,
)
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.sensors import LaserScan
from regraft.bus_schema.types_by_schema import DescribedType, describe_type, described_type
from regraft.client.json_view import as_json
from tests.schema.encoding.comparing import same
from tests.schema.every_type import KINDS, of_every_message
from tests.support.tables import check_each


class Colour(Enum):
    """A choice."""

    RED = "red"
    BLUE = "blue"


@message("schematest/Lamp")
@dataclass(frozen=True, slots=True)
class Lamp:
    """A record with a field of many kinds."""

    colour: Colour
    level: Annotated[float, Bounds(0.0, 1.0)]
    count: Count = 0
    text: str = ""
    picture: bytes = b""
    shades: tuple[Colour, ...] = ()
    far: Annotated[float, MayBeInfinite()] = 0.0
    near: float | None = None
    points: Annotated[FloatArray, Array("<f4", (None, 2))] = None  # type: ignore[assignment]
    corner: Annotated[FloatArray, Array("<f4", (3,))] | None = None


LAMP = described_type(describe_type(type_of(Lamp)))


def told(kind: MessageType) -> DescribedType:
    """Return a type as another program gets to know it."""
    return described_type(codec.decode(codec.encode(describe_type(kind)), type(describe_type(kind))))


def typed(value: Any, shape: Shape) -> Any:
    """Return a value as somebody would type it: in JSON, arrays as lists, bytes as base64."""
    if isinstance(shape, RecordShape):
        attributes = zip(shape.fields, shape.attributes, strict=True)
        fields = {name: typed(getattr(value, attribute), inner) for (name, inner), attribute in attributes}
        return {shape.tag[0]: shape.tag[1], **fields} if shape.tag else fields
    if isinstance(shape, ShorthandShape):
        return shape.pack(value)
    if isinstance(shape, UnionShape):
        return typed(value, shape.members[getattr(type(value), shape.key)])
    if isinstance(shape, OptionalShape):
        return None if value is None else typed(value, shape.item)
    if isinstance(shape, TupleShape):
        return [typed(item, shape.item) for item in value]
    if isinstance(shape, MapShape):
        return {name: typed(item, shape.item) for name, item in value.items()}
    if isinstance(shape, BytesShape):
        return base64.b64encode(value).decode()
    if isinstance(shape, ArrayShape):
        return {"dtype": value.dtype.str, "shape": list(value.shape), "data": value.tolist()}
    return value if isinstance(shape, FloatShape | PlainShape) else shape.pack(value)


def can_be_typed(value: Any) -> bool:
    """Tell whether lists say all of a record's arrays: not the shape of an empty one, nor the payload of a NaN."""
    arrays = (getattr(value, attribute) for attribute in type_of(type(value)).shape.attributes)
    return all(same(np.array(each.tolist(), each.dtype), each) for each in arrays if isinstance(each, np.ndarray))


@of_every_message()
def test_what_is_typed_becomes_the_bytes_that_the_class_gives(kind: MessageType, message: Any) -> None:
    if can_be_typed(message):
        payload = told(kind).encode(typed(message, kind.shape))
        assert same(codec.decode(payload, kind.cls), message)


def is_told_whole(kind: MessageType) -> None:
    """Check that another program gets to know all of a type."""
    described = told(kind)
    assert (described.name, described.encoding) == (kind.name, kind.encoding)
    assert described.schema == json.loads(json.dumps(kind.json_schema()))


def test_every_type_is_told_with_its_name_version_encoding_and_schema() -> None:
    check_each(KINDS, is_told_whole, lambda kind: kind.name)


@pytest.mark.parametrize(
    ("wrong", "field", "right"),
    [
        ({}, "colour", "must be one of: red, blue"),
        ({"colour": "red"}, "level", "must be a number of at least 0 and at most 1"),
        ({"colour": "green", "level": 0}, "colour", "must be one of: red, blue"),
        ({"colour": "red", "level": 2}, "level", "must be at most 1"),
        ({"colour": "red", "level": "half"}, "level", "must be a number"),
        ({"colour": "red", "level": 0, "count": 1.5}, "count", "must be an integer"),
        ({"colour": "red", "level": 0, "count": -1}, "count", "must be at least 0"),
        ({"colour": "red", "level": 0, "text": 5}, "text", "must be text"),
        ({"colour": "red", "level": 0, "picture": "?"}, "picture", "base64"),
        ({"colour": "red", "level": 0, "shades": "red"}, "shades", "must be a list"),
        ({"colour": "red", "level": 0, "shades": ["red", "grey"]}, "shades.1", "must be one of: red, blue"),
        ({"colour": "red", "level": 0, "near": float("inf")}, "near", "finite"),
        ({"colour": "red", "level": 0, "points": [[1, 2], [3]]}, "points", "even list"),
        ({"colour": "red", "level": 0, "points": [1, 2]}, "points", "(None, 2)"),
        ({"colour": "red", "level": 0, "points": {"dtype": "<f8", "data": [[1, 2]]}}, "points.dtype", "'<f4'"),
        ({"colour": "red", "level": 0, "points": {"shape": [2, 2], "data": [[1, 2]]}}, "points.shape", "[1, 2]"),
        ({"colour": "red", "level": 0, "points": "..."}, "points", "list of numbers"),
        ({"colour": "red", "level": 0, "points": [[1, "2"]]}, "points", "no number"),
        ({"colour": "red", "level": 0, "points": [[1, 1e300]]}, "points", "no number that fits <f4"),
        ({"colour": "red", "level": 0, "corner": []}, "corner", "(0,), must be (3,)"),
        ({"colour": "red", "level": 0, "colr": 1}, "", "did you mean 'colour'?"),
        (["red"], "", "must be a map"),
    ],
)
def test_what_does_not_fit_is_refused_by_field_with_what_would_be_right(wrong: Any, field: str, right: str) -> None:
    with pytest.raises(BadMessage) as refused:
        LAMP.pack(wrong)
    assert ".".join(refused.value.where) == field
    assert right in refused.value.why


def test_arrays_may_be_typed_as_lists_and_infinities_as_they_are_shown() -> None:
    body = {"colour": "blue", "level": 1, "far": "Infinity", "points": [[1, 2], [3, 4.5]]}
    lamp = codec.decode(LAMP.encode(body), Lamp)
    assert lamp.points.tolist() == [[1.0, 2.0], [3.0, 4.5]]
    assert lamp.far == float("inf")
    assert lamp.text == ""


def test_a_scan_can_be_typed_as_it_is_shown() -> None:
    ranges = np.array([1.0, np.inf, -np.inf, np.nan], np.float32)
    scan = LaserScan(0.0, "lidar", "base", Pose(), 0.0, 0.1, 0.1, 3.5, ranges)
    assert told(type_of(LaserScan)).encode(as_json(scan)) == codec.encode(scan)


def test_a_large_array_travels_as_the_tail_of_the_payload() -> None:
    ranges = np.array([1.0, 2.0, 3.0], np.float32)
    scan = LaserScan(0.0, "lidar", "base", Pose(), 0.0, 0.1, 0.1, 3.5, ranges)
    body = typed(scan, type_of(LaserScan).shape)
    assert told(type_of(LaserScan)).encode(body) == codec.encode(scan)


@pytest.mark.parametrize(
    "schema",
    ["", "[]", "7", "{", '{"anyOf": 3}', '{"type": "object", "properties": []}', "[" * 100_000],
)
def test_a_description_that_makes_no_sense_is_refused(schema: str) -> None:
    with pytest.raises(BadMessage):
        described_type(replace(describe_type(type_of(Lamp)), schema=schema))


def test_what_a_schema_of_somebody_else_does_not_say_is_left_to_the_receiver() -> None:
    schema = {"type": "object", "properties": {"a": {"$ref": "#/$defs/a"}, "b": {"type": ["string", "null"]}}}
    free = described_type(replace(describe_type(type_of(Lamp)), schema=json.dumps(schema)))
    body = {"a": [1, {"x": None}], "b": None, "c": "more"}
    assert free.pack(body) == body
