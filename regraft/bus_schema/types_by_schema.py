"""Message types known by their JSON Schema alone, as the programs that use them give it: no class is needed.

A typed value is checked against the schema and packed as the class would pack it. Keywords that
``MessageType.json_schema`` does not use are passed over: the receiver judges in the end.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from regraft.bus_schema.annotations import Array, PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.arrays import ArrayShape
from regraft.bus_schema.encoding.registry import MessageType
from regraft.bus_schema.encoding.shapes import (
    BoolShape,
    BytesShape,
    FloatShape,
    IntShape,
    JsonSchema,
    MapShape,
    OptionalShape,
    PlainShape,
    Shape,
    TextShape,
    TupleShape,
)
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import TypeDescription
from regraft.bus_schema.suggestions import instead_of

INFINITIES = {"Infinity": math.inf, "-Infinity": -math.inf}
NO_JSON_NUMBERS = {**INFINITIES, "NaN": math.nan}
"""How JSON views show what JSON lacks."""


@dataclass(frozen=True, slots=True)
class DescribedType:
    """A message type by name, with its encoding on the bus, its JSON Schema and the shape of typed input."""

    name: str
    encoding: str
    schema: JsonSchema
    shape: Shape

    def pack(self, typed: PlainValue) -> PlainValue:
        """Return what is typed in as the plain data that travels; raises BadMessage with the field at fault."""
        return self.shape.pack(typed)

    def encode(self, typed: PlainValue) -> bytes:
        """Return what is typed in as a payload; raises BadMessage with the field at fault."""
        packed = codec.pack_plain(self.pack(typed))
        tails = [(name, shape) for name, shape in _fields_of(self.shape).items() if _is_tail(shape)]
        return codec.with_tail(packed, tails[0][1].array(typed[tails[0][0]])) if tails else packed


def describe_type(kind: MessageType) -> TypeDescription:
    """Return what a program states of a message type that it knows."""
    return TypeDescription(kind.name, kind.version, kind.encoding, json.dumps(kind.json_schema(), ensure_ascii=False))


def described_type(description: TypeDescription) -> DescribedType:
    """Return the type that a program describes; raises BadMessage for a description that cannot be read."""
    try:
        schema = json.loads(description.schema)
        if not isinstance(schema, dict):
            raise BadMessage(f"is {type(schema).__name__}, must be a JSON Schema", ("schema",))
        return DescribedType(description.name, description.encoding, schema, shape_of_schema(schema))
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, BadMessage):
            raise
        raise BadMessage(f"is no JSON Schema that can be read ({type(error).__name__})", ("schema",)) from None


def shape_of_schema(schema: JsonSchema) -> Shape:
    """Return the shape of what may be typed in for a schema: any plain data for one with nothing known."""
    if "enum" in schema or "const" in schema:
        return _Choice(schema, tuple(schema.get("enum", (schema.get("const"),))))
    if "oneOf" in schema:
        return _union(schema)
    if "anyOf" in schema:
        others = [part for part in schema["anyOf"] if part != {"type": "null"}]
        return OptionalShape(shape_of_schema(others[0])) if len(others) == 1 else PlainShape()
    if "x-array" in schema:
        given = schema["x-array"]
        return _TypedArray(schema, ArrayShape(Array(given["dtype"], tuple(given["shape"]), given.get("tail", False))))
    return _simple(schema)


def _simple(schema: JsonSchema) -> Shape:
    kind, low, high = schema.get("type"), schema.get("minimum"), schema.get("maximum")
    if kind == "number":
        return _Number(schema, FloatShape(low, high, schema.get("x-infinite", False)))
    if kind == "integer":
        return IntShape(low, high)
    if kind == "boolean":
        return BoolShape()
    if kind == "string":
        return (
            _Base64(schema) if schema.get("contentEncoding") == "base64" else TextShape(schema.get("maxLength", 2**24))
        )
    if kind == "array" and isinstance(schema.get("items"), dict):
        return TupleShape(shape_of_schema(schema["items"]))
    if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        return MapShape(shape_of_schema(schema["additionalProperties"]))
    if kind == "object" and "properties" in schema:
        fields = {name: shape_of_schema(part) for name, part in schema["properties"].items()}
        return _Fields(schema, fields, frozenset(schema.get("required", ())))
    return PlainShape()


@dataclass(frozen=True, slots=True)
class _FromSchema:
    """The common part of all shapes that are made of a schema."""

    schema: JsonSchema

    def pack(self, value: Any) -> Any:
        raise NotImplementedError

    def unpack(self, plain: Any) -> Any:
        return self.pack(plain)

    def json_schema(self) -> JsonSchema:
        return self.schema


@dataclass(frozen=True, slots=True)
class _Fields(_FromSchema):
    """A record; fields that are left out take their defaults at the receiver."""

    fields: dict[str, Shape]
    required: frozenset[str]

    def pack(self, value: Any) -> dict[str, Any]:
        title = self.schema.get("title", "it")
        if not isinstance(value, dict):
            raise BadMessage(f"is {type(value).__name__}, must be a map with the fields of {title}")
        unknown = [name for name in value if name not in self.fields]
        if unknown and self.schema.get("additionalProperties") is False:
            hint = instead_of(str(unknown[0]), self.fields, none="it has none")
            raise BadMessage(f"has no field {unknown[0]!r}; {hint}")
        packed = {name: value[name] for name in unknown}
        for name, shape in self.fields.items():
            try:
                if name in value:
                    packed[name] = shape.pack(value[name])
                elif name in self.required:
                    raise BadMessage(f"is missing: must be {_wanted(shape)}")
            except BadMessage as error:
                raise error.inside(name) from None
        return packed


@dataclass(frozen=True, slots=True)
class _Choice(_FromSchema):
    """One of several values."""

    choices: tuple[Any, ...]

    def pack(self, value: Any) -> Any:
        if value not in self.choices or isinstance(value, bool) not in {
            isinstance(each, bool) for each in self.choices
        }:
            raise BadMessage(f"is {value!r}, must be one of: {', '.join(map(str, self.choices))}")
        return value


@dataclass(frozen=True, slots=True)
class _Union(_FromSchema):
    """One of several records, distinguished by the value of a field."""

    key: str
    members: dict[str, Shape]

    def pack(self, value: Any) -> Any:
        if not isinstance(value, dict):
            raise BadMessage(f"is {type(value).__name__}, must be a map with a {self.key!r}")
        tag = value.get(self.key)
        if not isinstance(tag, str) or tag not in self.members:
            raise BadMessage(f"is {tag!r}, must be one of: {', '.join(sorted(self.members))}", (self.key,))
        return self.members[tag].pack(value)


def _union(schema: JsonSchema) -> Shape:
    """Return a union whose members one constant field distinguishes; any plain data where there is none."""
    constants = [
        {name: part["const"] for name, part in member.get("properties", {}).items() if "const" in part}
        for member in schema["oneOf"]
    ]
    keys = sorted(set.intersection(*(set(each) for each in constants))) if constants else []
    if not keys:
        return PlainShape()
    members = zip(constants, schema["oneOf"], strict=True)
    return _Union(schema, keys[0], {each[keys[0]]: shape_of_schema(member) for each, member in members})


@dataclass(frozen=True, slots=True)
class _Number(_FromSchema):
    """A number, an infinite one also as JSON views show it."""

    number: FloatShape

    def pack(self, value: Any) -> float:
        return self.number.pack(INFINITIES.get(value, value) if isinstance(value, str) else value)


@dataclass(frozen=True, slots=True)
class _Base64(_FromSchema):
    """Bytes, typed as base64."""

    def pack(self, value: Any) -> bytes:
        if not isinstance(value, str):
            return BytesShape().pack(value)
        try:
            return base64.b64decode(value, validate=True)
        except (binascii.Error, ValueError):
            raise BadMessage("is no base64 text") from None


@dataclass(frozen=True, slots=True)
class _TypedArray(_FromSchema):
    """An array, typed as nested lists or as JSON views show it: a map with its ``data``."""

    layout: ArrayShape

    def array(self, value: Any) -> np.ndarray[Any, Any]:
        wanted = self.layout.layout
        if isinstance(value, dict):
            data, shape = value.get("data"), value.get("shape")
            if not isinstance(data, list) or value.keys() - {"dtype", "shape", "data"}:
                raise BadMessage("must be a list of numbers, or a map of dtype, shape and data, its numbers in lists")
            if value.get("dtype", wanted.dtype) != wanted.dtype:
                raise BadMessage(f"is of {value['dtype']!r}, must be of {wanted.dtype!r}", ("dtype",))
            array = self.array(data)
            if shape is not None and list(array.shape) != shape:
                raise BadMessage(f"is {shape}, but the data has the shape {list(array.shape)}", ("shape",))
            return array
        if not isinstance(value, list):
            raise BadMessage(f"is {type(value).__name__}, must be a list of numbers ({wanted.dtype})")
        dtype = np.dtype(wanted.dtype)
        try:
            given = np.array(_with_floats(value) if dtype.kind == "f" else value)
            given = given if value else given.reshape(0, *(length or 0 for length in wanted.shape[1:]))
            with np.errstate(over="ignore"):
                exact = given.astype(dtype)
        except (ValueError, TypeError, OverflowError, RecursionError):
            raise BadMessage(f"is no even list of numbers that fit {wanted.dtype}") from None
        if given.dtype.kind not in "iufb" or not _holds(exact, given):
            raise BadMessage(f"holds what is no number that fits {wanted.dtype}")
        return self.layout.check(exact)

    def pack(self, value: Any) -> Any:
        return self.layout.pack(self.array(value))


def _with_floats(value: Any) -> Any:
    """Return nested lists with the numbers that JSON views show as texts."""
    if isinstance(value, list):
        return [_with_floats(item) for item in value]
    return NO_JSON_NUMBERS.get(value, value) if isinstance(value, str) else value


def _holds(exact: np.ndarray[Any, Any], given: np.ndarray[Any, Any]) -> bool:
    """Return whether the numbers of a dtype are those that were given; those of floats may be rounded."""
    if exact.dtype.kind == "f":
        return np.array_equal(np.isinf(exact), np.isinf(given.astype(float)))
    return np.array_equal(given, exact)


def _fields_of(shape: Shape) -> dict[str, Any]:
    return dict(shape.fields) if isinstance(shape, _Fields) else {}


def _is_tail(shape: Shape) -> bool:
    return isinstance(shape, _TypedArray) and shape.layout.layout.tail


def _wanted(shape: Shape) -> str:
    """Return in words what a field must be that is missing."""
    schema = shape.json_schema()
    if "enum" in schema or "const" in schema:
        return f"one of: {', '.join(map(str, schema.get('enum', (schema.get('const'),))))}"
    words = {"object": "map", "array": "list", "string": "text", "boolean": "true or false", "integer": "whole number"}
    kind = schema.get("type", "value")
    word = words.get(kind, kind)
    bounds = [
        f"{'at least' if key == 'minimum' else 'at most'} {schema[key]:g}"
        for key in ("minimum", "maximum")
        if key in schema
    ]
    article = "" if word in ("text", "true or false") else "a "
    return f"{article}{word}{' of ' if bounds else ''}{' and '.join(bounds)}"
