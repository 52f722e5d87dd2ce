"""Shapes of dataclasses: built once per class from its type hints, then used for every message."""

from __future__ import annotations

import dataclasses
import inspect
import types
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from regraft.bus_schema.annotations import Array, Bounds, MayBeInfinite, Named, OneOf, Tagged, Text, Unit
from regraft.bus_schema.encoding import shapes
from regraft.bus_schema.encoding.arrays import KNOWN_DTYPES, ArrayShape
from regraft.bus_schema.encoding.shapes import JsonSchema, Shape
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.bus_schema.former_names import present_name
from regraft.bus_schema.suggestions import near

FITTING: dict[type, tuple[type, ...]] = {
    Bounds: (float, int),
    MayBeInfinite: (float,),
    Text: (str,),
    OneOf: (Enum,),
}
"""The types of which a note checks the values."""
VARIABLE = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
SHORTHAND = "shorthand"
"""The ClassVar of a dataclass that names the field that a text alone gives."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordShape:
    """A dataclass: a map from field name to value. Unknown fields are refused, absent ones take their default.

    ``attributes`` are the attributes of the ``fields``, in their order. There is one for each class and tag.
    """

    cls: type
    fields: tuple[tuple[str, Shape], ...]
    attributes: tuple[str, ...]
    optional: frozenset[str]
    tag: tuple[str, str] | None = None
    names: frozenset[str] = field(default=frozenset())

    def pack(self, value: Any) -> dict[str, Any]:
        """Return a map of the packed fields, led by the tag where the record is a member of a union."""
        if type(value) is not self.cls:
            raise BadMessage(f"is {type(value).__name__}, must be {self.cls.__name__}")
        plain: dict[str, Any] = {self.tag[0]: self.tag[1]} if self.tag else {}
        name = ""
        try:
            for (name, shape), attribute in zip(self.fields, self.attributes, strict=True):
                plain[name] = shape.pack(getattr(value, attribute))
        except BadMessage as error:
            raise error.inside(name) from None
        return plain

    def unpack(self, plain: Any) -> Any:
        """Return an instance of the dataclass."""
        if type(plain) is not dict:
            raise BadMessage(f"is {type(plain).__name__}, must be a map with the fields of {self.cls.__name__}")
        values = {}
        name = ""
        try:
            for (name, shape), attribute in zip(self.fields, self.attributes, strict=True):
                if name in plain:
                    values[attribute] = shape.unpack(plain[name])
                elif name not in self.optional:
                    self._refuse_former_names(plain)
                    raise BadMessage("is missing")
        except BadMessage as error:
            raise error.inside(name) from None
        if len(values) != len(plain):
            self._refuse_unknown(plain)
        try:
            return self.cls(**values)
        except BadMessage:
            raise
        except ValueError as error:
            raise BadMessage(str(error)) from None

    def _refuse_former_names(self, plain: dict[str, Any]) -> None:
        for name in plain:
            if (present := present_name(name, self.names)) is not None:
                raise BadMessage(f"has no field {name!r}: it is called {present!r}")

    def _refuse_unknown(self, plain: dict[str, Any]) -> None:
        self._refuse_former_names(plain)
        unknown = sorted(str(key) for key in plain if key not in self.names)
        if unknown:
            known = ", ".join(sorted(self.names))
            meant = near(unknown[0], self.names)
            hint = "" if meant is None else f"did you mean {meant!r}? "
            raise BadMessage(f"has no field {', '.join(map(repr, unknown))}; {hint}{self.cls.__name__} has: {known}")

    def json_schema(self) -> JsonSchema:
        """Return an ``object`` with the docstring as its description."""
        properties: JsonSchema = {}
        if self.tag:
            properties[self.tag[0]] = {"const": self.tag[1]}
        properties |= {name: shape.json_schema() for name, shape in self.fields}
        required = [name for name in properties if name not in self.optional]
        schema: JsonSchema = {
            "title": self.cls.__name__,
            "type": "object",
            "properties": properties,
            "additionalProperties": False,
        }
        if required:
            schema["required"] = required
        if self.cls.__doc__:
            schema["description"] = self.cls.__doc__.strip().split("\n\n")[0]
        return schema


@dataclass(frozen=True, slots=True)
class UnionShape:
    """One of several dataclasses, distinguished by a tag."""

    key: str
    members: dict[str, RecordShape]

    def pack(self, value: Any) -> Any:
        """Return the member's map, with its tag."""
        tag = getattr(type(value), self.key, None)
        if tag not in self.members:
            raise BadMessage(f"is {type(value).__name__}, must be one of: {', '.join(sorted(self.members))}")
        return self.members[tag].pack(value)

    def unpack(self, plain: Any) -> Any:
        """Return the member that the tag names."""
        if type(plain) is not dict:
            raise BadMessage(f"is {type(plain).__name__}, must be a map with a {self.key!r}")
        tag = plain.get(self.key)
        if not isinstance(tag, str) or tag not in self.members:
            shown = repr(tag) if isinstance(tag, str) else type(tag).__name__
            raise BadMessage(f"is {shown}, must be one of: {', '.join(sorted(self.members))}", (self.key,))
        return self.members[tag].unpack(plain)

    def json_schema(self) -> JsonSchema:
        """Return ``oneOf`` the members."""
        return {"oneOf": [member.json_schema() for member in self.members.values()]}


@dataclass(frozen=True, slots=True)
class ShorthandShape:
    """A record that may be written as a text alone: the value of its field ``field``."""

    record: RecordShape
    field: str
    text: Shape

    def pack(self, value: Any) -> Any:
        """Return the text if the record has nothing else, else a map without the fields that are at their defaults."""
        plain = self.record.pack(value)
        defaults = {spec.name: spec.default for spec in dataclasses.fields(self.record.cls)}
        given = {
            name: plain[name]
            for (name, _), attribute in zip(self.record.fields, self.record.attributes, strict=True)
            if getattr(value, attribute) != defaults[attribute]
        }
        return given[self.field] if given.keys() == {self.field} else given

    def unpack(self, plain: Any) -> Any:
        """Return an instance of the dataclass."""
        return self.record.unpack({self.field: plain} if isinstance(plain, str) else plain)

    def json_schema(self) -> JsonSchema:
        """Return ``anyOf`` the text and the record."""
        return {"anyOf": [self.text.json_schema(), self.record.json_schema()]}


@cache
def record_shape(cls: type, tag: tuple[str, str] | None = None) -> RecordShape:
    """Return the shape of a dataclass.

    Raises:
        BadType: the class is no dataclass, or a field has a type that cannot travel.
    """
    if not dataclasses.is_dataclass(cls):
        raise BadType(f"{cls.__qualname__} must be a dataclass")
    _check_making(cls)
    hints = get_type_hints(cls, include_extras=True)
    fields = []
    attributes = []
    optional = set()
    for spec in dataclasses.fields(cls):
        name = _name_of(spec.name, hints[spec.name])
        try:
            fields.append((name, shape_of(hints[spec.name])))
        except BadType as error:
            raise BadType(f"{cls.__qualname__}.{spec.name}: {error}") from None
        attributes.append(spec.name)
        if spec.default is not dataclasses.MISSING or spec.default_factory is not dataclasses.MISSING:
            optional.add(name)
    names = frozenset(name for name, _ in fields) | ({tag[0]} if tag else frozenset())
    if len(names) < len(fields):
        raise BadType(f"{cls.__qualname__} has two fields of one name")
    return _accepting_tag(RecordShape(cls, tuple(fields), tuple(attributes), frozenset(optional), tag, names))


def _check_making(cls: type) -> None:
    """Refuse a class that cannot be made of its fields; raises BadType."""
    parameters = inspect.signature(cls).parameters
    fields = [spec.name for spec in dataclasses.fields(cls)]
    takes_any = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values())
    for name in fields:
        if name not in parameters and not takes_any:
            raise BadType(f"{cls.__qualname__}.{name}: __init__ does not take it, so no reader could make the message")
    for name, parameter in parameters.items():
        is_needed = parameter.default is parameter.empty and parameter.kind not in VARIABLE
        if name not in fields and is_needed:
            raise BadType(f"{cls.__qualname__}: __init__ takes {name!r}, which is no field and does not travel")


@cache
def attributes_of(cls: type) -> dict[str, str]:
    """Return the attributes of a dataclass by the names under which they travel; raises BadType."""
    shape = record_shape(cls)
    return {name: attribute for (name, _), attribute in zip(shape.fields, shape.attributes, strict=True)}


def _name_of(attribute: str, hint: Any) -> str:
    notes = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((note.name for note in notes if isinstance(note, Named)), attribute)


def _accepting_tag(shape: RecordShape) -> RecordShape:
    if shape.tag and any(name == shape.tag[0] for name, _ in shape.fields):
        raise BadType(f"{shape.cls.__qualname__} has a field named like the tag {shape.tag[0]!r}")
    return shape


def shape_of(hint: Any) -> Shape:
    """Return the shape of a type hint; raises BadType for one that cannot travel."""
    notes: tuple[Any, ...] = ()
    if get_origin(hint) is Annotated:
        hint, *extras = get_args(hint)
        notes = tuple(note for note in extras if not isinstance(note, Named))
    origin, arguments = get_origin(hint), get_args(hint)
    tagged = next((note for note in notes if isinstance(note, Tagged)), None)
    if tagged is not None:
        return _union(tagged.key, arguments)
    if origin in (Union, types.UnionType):
        return _optional(arguments, notes)
    if origin is tuple and len(arguments) == 2 and arguments[1] is Ellipsis:
        return shapes.TupleShape(_item(arguments[0], notes))
    if origin is dict and arguments[0] is str:
        return shapes.MapShape(_item(arguments[1], notes))
    layout = next((note for note in notes if isinstance(note, Array)), None)
    if layout is not None:
        return _array(hint, layout)
    if origin is np.ndarray or hint is np.ndarray:
        raise BadType("an array needs Annotated[..., Array(dtype, shape)]")
    _check_notes(hint, notes)
    return shapes.PlainShape() if hint is Any else _scalar(hint, notes)


def _item(hint: Any, notes: tuple[Any, ...]) -> Shape:
    """Return the shape of what there are several of: notes of all hold for each."""
    return shape_of(Annotated[(hint, *notes)] if notes else hint)


def _array(hint: Any, layout: Array) -> Shape:
    if hint is not np.ndarray and get_origin(hint) is not np.ndarray:
        raise BadType(f"{hint!r} has an array's layout, but is no array")
    try:
        known = np.dtype(layout.dtype).str.encode() in KNOWN_DTYPES
    except TypeError:
        known = False
    if not known:
        travel = ", ".join(sorted(dtype.decode() for dtype in KNOWN_DTYPES))
        raise BadType(f"an array of {layout.dtype!r} cannot travel; these can: {travel}")
    if not layout.shape:
        raise BadType("an array needs a dimension at least: a number alone is a float")
    return ArrayShape(layout)


def _check_notes(hint: Any, notes: tuple[Any, ...]) -> None:
    """Refuse a note that would check nothing; raises BadType."""
    kind = Enum if isinstance(hint, type) and issubclass(hint, Enum) else hint
    for note in notes:
        if kind not in FITTING.get(type(note), (kind,)):
            raise BadType(f"{type(note).__name__} checks nothing of {hint!r}")


def holds_tail(shape: Shape) -> bool:
    """Return whether a value of this shape is, or contains, an array that travels as the payload's tail."""
    return any(array.layout.tail for array in arrays_in(shape))


def arrays_in(shape: Shape) -> Iterator[ArrayShape]:
    """Yield the shapes of the arrays that a value of this shape is or contains."""
    inner: Iterable[Shape] = ()
    match shape:
        case ArrayShape():
            yield shape
        case shapes.TupleShape() | shapes.MapShape() | shapes.OptionalShape():
            inner = (shape.item,)
        case RecordShape():
            inner = (each for _, each in shape.fields)
        case ShorthandShape():
            inner = (shape.record,)
        case UnionShape():
            inner = shape.members.values()
    for each in inner:
        yield from arrays_in(each)


def _scalar(hint: Any, notes: tuple[Any, ...]) -> Shape:
    bounds = next((note for note in notes if isinstance(note, Bounds)), Bounds())
    unit = next((note.symbol for note in notes if isinstance(note, Unit)), None)
    if hint is float:
        infinite = any(isinstance(note, MayBeInfinite) for note in notes)
        return shapes.FloatShape(bounds.minimum, bounds.maximum, infinite, unit)
    if hint is int:
        return shapes.IntShape(bounds.minimum, bounds.maximum, unit)
    if hint is bool:
        return shapes.BoolShape()
    if hint is str:
        text = next((note for note in notes if isinstance(note, Text)), None)
        return shapes.TextShape(unit=unit) if text is None else shapes.TextShape(text.longest, text.cut, unit)
    if hint is bytes:
        return shapes.BytesShape()
    if isinstance(hint, type) and issubclass(hint, Enum):
        if not all(isinstance(member.value, str) for member in hint):
            raise BadType(f"{hint.__qualname__} is no enumeration of texts: its values travel, and must be texts")
        allowed = next((note.members for note in notes if isinstance(note, OneOf)), tuple(hint))
        return shapes.EnumShape(hint, allowed)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _with_shorthand(record_shape(hint))
    raise BadType(f"{hint!r} cannot travel in a message")


def _with_shorthand(shape: RecordShape) -> Shape:
    field = getattr(shape.cls, SHORTHAND, None)
    return shape if field is None else ShorthandShape(shape, field, dict(shape.fields)[field])


def _optional(arguments: tuple[Any, ...], notes: tuple[Any, ...]) -> Shape:
    others = [argument for argument in arguments if argument is not type(None)]
    if len(others) != 1 or len(others) == len(arguments):
        raise BadType("a union needs Annotated[..., Tagged(key)] unless it is 'T | None'")
    return shapes.OptionalShape(_item(others[0], notes))


def _union(key: str, classes: tuple[Any, ...]) -> UnionShape:
    members: dict[str, RecordShape] = {}
    for cls in classes:
        tag = getattr(cls, key, None)
        if not isinstance(tag, str):
            raise BadType(f"{cls!r} is a member of a union tagged {key!r}, but has no ClassVar of that name")
        if tag in members:
            raise BadType(f"{cls!r} has the tag {tag!r}, as {members[tag].cls!r} has")
        members[tag] = record_shape(cls, (key, tag))
    return UnionShape(key, members)
