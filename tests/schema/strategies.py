"""Hypothesis strategies for messages, derived from their shapes: one builder per kind of shape."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

import regraft.bus_schema.messages
import regraft.runtime.core.assignment
from regraft import bus_schema
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
from regraft.bus_schema.messages.protocol.requests import Request
from regraft.bus_schema.messages.sensors import DepthImage, Image
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.watched import Condition

Values = SearchStrategy[Any]

OURS = ("regraft",)
MAX_LIST_LENGTH = 2

_built: dict[int, tuple[Shape, Values]] = {}

CONDITIONS = (
    Condition("MoveSafely"),
    Condition(quality="camera.rate", at_least=1.0, unknown_for=2.0),
    Condition(quality="camera.rate", within=(0.5, 1.5)),
    Condition(component="camera", state=State.ACTIVE),
    Condition(require="camera.rate < 3.0 or not lamp.active"),
)
"""Conditions of every kind: most combinations of their fields are refused."""
FIELDS: dict[tuple[type, str], Values] = {
    (Request, "client"): st.from_regex(r"[A-Za-z0-9_.-]{1,30}", fullmatch=True),
    (Image, "horizontal_field_of_view"): st.floats(0.001, 3.09),
    (DepthImage, "horizontal_field_of_view"): st.floats(0.001, 3.09),
}
"""Fields whose class demands more than their shape says."""


def all_types() -> tuple[MessageType, ...]:
    """Return every message type of ours, with all modules that define one imported."""
    for package in (bus_schema, bus_schema.messages):
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
            importlib.import_module(module.name)
    importlib.import_module(regraft.runtime.core.assignment.__name__)
    return tuple(kind for kind in known_types() if kind.name.split("/")[0] in OURS)


def values(shape: Shape) -> Values:
    """Return a strategy for the Python values of a shape, built once."""
    found = _built.get(id(shape))
    if found is None or found[0] is not shape:
        found = _built[id(shape)] = (shape, BUILDERS[type(shape)](shape))
    return found[1]


def texts(longest: int = 65_536) -> SearchStrategy[str]:
    """Return a strategy for text that can be encoded."""
    return st.text(st.characters(codec="utf-8"), max_size=min(longest, 12))


def _floats(shape: FloatShape) -> Values:
    return st.floats(shape.minimum, shape.maximum, allow_nan=False, allow_infinity=shape.infinite)


def _ints(shape: IntShape) -> Values:
    lowest = -(2**63) if shape.minimum is None else int(shape.minimum)
    return st.integers(lowest, 2**64 - 1 if shape.maximum is None else int(shape.maximum))


def _tuples(shape: TupleShape) -> Values:
    return st.lists(values(shape.item), max_size=MAX_LIST_LENGTH).map(tuple)


def _maps(shape: MapShape) -> Values:
    return st.dictionaries(texts(), values(shape.item), max_size=MAX_LIST_LENGTH)


def _plain(_: PlainShape) -> Values:
    leaves = st.one_of(
        st.none(),
        st.booleans(),
        st.integers(-(2**63), 2**64 - 1),
        st.floats(allow_nan=False),
        texts(),
        st.binary(max_size=8),
    )

    def nested(inner: Values) -> Values:
        return st.lists(inner, max_size=MAX_LIST_LENGTH) | st.dictionaries(texts(), inner, max_size=MAX_LIST_LENGTH)

    return st.recursive(leaves, nested, max_leaves=6)


def _arrays(shape: ArrayShape) -> Values:
    lengths = st.tuples(*(st.integers(0, 4) if n is None else st.just(n) for n in shape.layout.shape))

    def filled(dimensions: tuple[int, ...]) -> Values:
        size = int(np.prod(dimensions)) * np.dtype(shape.layout.dtype).itemsize
        raw = st.binary(min_size=size, max_size=size)
        return raw.map(lambda data: np.frombuffer(data, shape.layout.dtype).reshape(dimensions))

    return lengths.flatmap(filled)


def _records(shape: RecordShape) -> Values:
    attributes = dict(zip(shape.attributes, shape.fields, strict=True))
    given = {name: FIELDS.get((shape.cls, name), values(inner)) for name, (_, inner) in attributes.items()}
    needed = {name: value for name, value in given.items() if attributes[name][0] not in shape.optional}
    optional = {name: value for name, value in given.items() if name not in needed}
    return st.fixed_dictionaries(needed, optional=optional).map(lambda fields: shape.cls(**fields))


def _unions(shape: UnionShape) -> Values:
    return st.one_of(*(values(member) for member in shape.members.values()))


BUILDERS: dict[type, Callable[[Any], Values]] = {
    FloatShape: _floats,
    IntShape: _ints,
    BoolShape: lambda _: st.booleans(),
    TextShape: lambda shape: texts(shape.longest),
    BytesShape: lambda _: st.binary(max_size=16),
    EnumShape: lambda shape: st.sampled_from(list(shape.members)),
    TupleShape: _tuples,
    MapShape: _maps,
    OptionalShape: lambda shape: st.none() | values(shape.item),
    PlainShape: _plain,
    ArrayShape: _arrays,
    RecordShape: _records,
    ShorthandShape: lambda _: st.sampled_from(CONDITIONS),
    UnionShape: _unions,
}
