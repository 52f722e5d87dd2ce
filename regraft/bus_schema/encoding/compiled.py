"""The short way through a record: two functions per message type, written out field by field when first used.

A message that fits takes this way, which costs a third of the walk along its shapes. One that does not fit takes the
walk after all: shapes alone decide what is wrong, and report it.
"""

from __future__ import annotations

import dataclasses
import inspect
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

from regraft.bus_schema.encoding.records import RecordShape, UnionShape, record_shape
from regraft.bus_schema.encoding.shapes import (
    INT_RANGE,
    BoolShape,
    BytesShape,
    EnumShape,
    FloatShape,
    IntShape,
    MapShape,
    OptionalShape,
    Shape,
    TextShape,
    TupleShape,
)
from regraft.bus_schema.errors import BadMessage

Convert = Callable[[Any], Any]

SAME = "{v}"
"""The conversion of a value that travels as it is."""


@dataclasses.dataclass(frozen=True, slots=True)
class _Field:
    """Two Python expressions over the variable ``{v}``: whether the value is as plain as can be, and its conversion."""

    test: str
    value: str = SAME

    def test_of(self, variable: str) -> str:
        return self.test.replace("{v}", variable)

    def value_of(self, variable: str) -> str:
        return self.value.replace("{v}", variable)


class _Names:
    """The objects that the written functions refer to, by made-up names."""

    def __init__(self, **known: Any) -> None:
        self.known: dict[str, Any] = known

    def add(self, thing: Any) -> str:
        name = f"_{len(self.known)}"
        self.known[name] = thing
        return name


def compile_pack(cls: type) -> Convert:
    """Return what the ``pack`` of a dataclass's shape does, faster."""
    return _pack_of(record_shape(cls))


def compile_unpack(cls: type) -> Convert:
    """Return what the ``unpack`` of a dataclass's shape does, faster."""
    return _unpack_of(record_shape(cls))


@cache
def _pack_of(shape: RecordShape) -> Convert:
    if not _is_simple(shape):
        return shape.pack
    names = _Names(cls=shape.cls, walk=shape.pack, BadMessage=BadMessage)
    fields = [_packing(inner, names) for _, inner in shape.fields]
    variables = [f"v{index}" for index in range(len(fields))]
    reads = "\n    ".join(
        f"{variable} = record.{attribute}" for variable, attribute in zip(variables, shape.attributes, strict=True)
    )
    items = [
        f"{name!r}: {field.value_of(variable)}"
        for variable, field, (name, _) in zip(variables, fields, shape.fields, strict=True)
    ]
    if shape.tag:
        items.insert(0, "{!r}: {!r}".format(*shape.tag))
    text = f"""
def pack(record):
    if type(record) is not cls:
        return walk(record)
    {reads}
    try:
        if {_all(fields, variables)}:
            return {{{", ".join(items)}}}
    except (BadMessage, KeyError, TypeError):
        pass
    return walk(record)
"""
    return _define("pack", text, names)


@cache
def _unpack_of(shape: RecordShape) -> Convert:
    """Return the function. A member of a union is chosen by its tag before, which needs no further look."""
    if not _is_simple(shape):
        return shape.unpack
    names = _Names(cls=shape.cls, walk=shape.unpack, BadMessage=BadMessage)
    fields = [_unpacking(inner, names) for _, inner in shape.fields]
    variables = [f"v{index}" for index in range(len(fields))]
    reads = "\n            ".join(
        f"{variable} = plain[{name!r}]" for variable, (name, _) in zip(variables, shape.fields, strict=True)
    )
    values = [field.value_of(variable) for variable, field in zip(variables, fields, strict=True)]
    making = "\n                ".join(_making(shape, values, names))
    text = f"""
def unpack(plain):
    if type(plain) is dict and len(plain) == {len(fields) + bool(shape.tag)}:
        try:
            {reads}
            if {_all(fields, variables)}:
                {making}
        except (BadMessage, LookupError, TypeError, ValueError):
            pass
    return walk(plain)
"""
    return _define("unpack", text, names)


def _making(shape: RecordShape, values: list[str], names: _Names) -> list[str]:
    """Return the statements that make and return the record; without checks of its own, it needs no ``__init__``."""
    cls: Any = shape.cls
    slots = [vars(cls).get(attribute) for attribute in shape.attributes]
    if (
        hasattr(cls, "__post_init__")
        or not cls.__dataclass_params__.init
        or not all(inspect.ismemberdescriptor(slot) for slot in slots)
    ):
        return [f"return cls({', '.join(values)})"]
    setters = [names.add(slot.__set__) for slot in slots if slot is not None]
    filling = [f"{setter}(record, {value})" for setter, value in zip(setters, values, strict=True)]
    return [f"record = {names.add(object.__new__)}(cls)", *filling, "return record"]


def _is_simple(shape: RecordShape) -> bool:
    """Return whether the class takes its fields by position."""
    fields: Any = dataclasses.fields(shape.cls)
    return bool(fields) and all(field.init and not field.kw_only for field in fields)


def _all(fields: list[_Field], variables: list[str]) -> str:
    tests = [field.test_of(variable) for variable, field in zip(variables, fields, strict=True) if field.test]
    return " and ".join(tests) or "True"


def _define(name: str, text: str, names: _Names) -> Convert:
    # Nothing from outside gets in here: the text is made of field names of dataclasses and of the parts above.
    exec(compile(text, f"<{name} {names.known['cls'].__qualname__}>", "exec"), names.known)
    made: Convert = names.known[name]
    return made


def _packing(shape: Shape, names: _Names) -> _Field:
    if isinstance(shape, EnumShape):
        return _Field(f"type({{v}}) is {names.add(shape.members)}", "{v}._value_")
    if isinstance(shape, RecordShape):
        return _Field("", f"{names.add(_pack_of(shape))}({{v}})")
    if isinstance(shape, UnionShape):
        by_class = {member.cls: _pack_of(member) for member in shape.members.values()}
        return _Field("", f"{names.add(by_class)}[type({{v}})]({{v}})")
    return _leaf(shape) or _nested(shape, names, _packing) or _Field("", f"{names.add(shape.pack)}({{v}})")


def _unpacking(shape: Shape, names: _Names) -> _Field:
    if isinstance(shape, EnumShape):
        members = names.add({member.value: member for member in shape.allowed})
        return _Field(f"{{v}} in {members}", f"{members}[{{v}}]")
    if isinstance(shape, RecordShape):
        return _Field("", f"{names.add(_unpack_of(shape))}({{v}})")
    if isinstance(shape, UnionShape):
        by_tag = {tag: _unpack_of(member) for tag, member in shape.members.items()}
        return _Field("", f"{names.add(by_tag)}[{{v}}[{shape.key!r}]]({{v}})")
    return _leaf(shape) or _nested(shape, names, _unpacking) or _Field("", f"{names.add(shape.unpack)}({{v}})")


def _nested(shape: Shape, names: _Names, part: Callable[[Shape, _Names], _Field]) -> _Field | None:
    if isinstance(shape, OptionalShape):
        inner = part(shape.item, names)
        test = f"({{v}} is None or {inner.test})" if inner.test else ""
        return _Field(test, inner.value if inner.value == SAME else f"(None if {{v}} is None else {inner.value})")
    if isinstance(shape, MapShape):
        item = part(shape.item, names)
        inside = f"all(map({names.add(str.isascii)}, {{v}}))"
        if item.test:
            inside += f" and all([{item.test_of('item')} for item in {{v}}.values()])"
        value = f"{{key: {item.value_of('item')} for key, item in {{v}}.items()}}"
        return _Field(f"type({{v}}) is dict and (not {{v}} or {inside})", "{v}.copy()" if item.value == SAME else value)
    if isinstance(shape, TupleShape):
        item = part(shape.item, names)
        test = "type({v}) in (list, tuple)"
        if item.test:
            test += f" and (not {{v}} or all([{item.test_of('item')} for item in {{v}}]))"
        items = "{v}" if item.value == SAME else f"[{item.value_of('item')} for item in {{v}}]"
        return _Field(test, f"{'list' if part is _packing else 'tuple'}({items})")
    return None


def _leaf(shape: Shape) -> _Field | None:
    """Return the test of a value that travels as it is."""
    if isinstance(shape, FloatShape):
        most = float("inf") if shape.infinite else sys.float_info.max
        return _Field(f"type({{v}}) is float and {_range(shape.minimum, shape.maximum, -most, most)}")
    if isinstance(shape, IntShape):
        return _Field(f"type({{v}}) is int and {_range(shape.minimum, shape.maximum, INT_RANGE[0], INT_RANGE[-1])}")
    if isinstance(shape, BoolShape):
        return _Field("type({v}) is bool")
    if isinstance(shape, TextShape):
        return _Field(f"type({{v}}) is str and len({{v}}) <= {shape.longest} and {{v}}.isascii()")
    if isinstance(shape, BytesShape):
        return _Field("type({v}) is bytes")
    return None


def _range(minimum: float | None, maximum: float | None, least: float, most: float) -> str:
    low = least if minimum is None else max(minimum, least)
    high = most if maximum is None else min(maximum, most)
    return f"{_number(low)} <= {{v}} <= {_number(high)}"


def _number(number: float) -> str:
    if number in (float("inf"), float("-inf")):
        return "1e999" if number > 0 else "-1e999"
    return repr(number)
