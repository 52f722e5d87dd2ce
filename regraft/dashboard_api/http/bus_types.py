"""Records of the bus as pydantic and FastAPI take them: their shapes check, pack and describe them here too.

A message is declared once, as a dataclass. The schemas of bodies and answers follow from that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Annotated, Any, Final, TypeVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PlainValidator, ValidationError, WithJsonSchema
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from regraft.bus_schema.encoding.records import attributes_of, record_shape
from regraft.bus_schema.encoding.shapes import INT_RANGE, JsonSchema, MapShape, Shape
from regraft.bus_schema.errors import BadCombination, BadMessage
from regraft.client import as_json

T = TypeVar("T")

JsonObject = dict[str, Any]
NOTHING: JsonSchema = {}
MISFIT: Final = "misfit"
COMBINATION: Final = "combination"
"""The kinds of errors: a value that does not fit its type, and fields that do not fit each other."""
MAX_TOLD = 100
"""Violations of one request that are reported."""


def to_json(value: Any) -> Any:
    """Return a dataclass, a message or a view of this API, as JSON values; raises BadMessage."""
    cls: Any = type(value)
    return as_json(record_shape(cls).pack(value))


class _Packed:
    """Has pydantic show a dataclass as JSON.

    It is packed where pydantic validates, which FastAPI does in a thread: large answers keep nobody waiting.
    """

    def __get_pydantic_core_schema__(self, cls: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        described = WithJsonSchema(record_shape(cls).json_schema())
        schema = handler.generate_schema(Annotated[Any, PlainValidator(to_json), described])
        return {**schema, "ref": f"{cls.__module__}.{cls.__qualname__}:{id(cls)}"}


Shown = Annotated[T, _Packed()]
"""The answer of a route: a dataclass, which is sent as JSON and named in the OpenAPI document."""


def checked(shape: Shape, also: JsonSchema = NOTHING) -> Any:
    """Return the type of plain data that a shape checks and unpacks; ``also`` is added in the document."""

    def unpack(plain: Any) -> Any:
        try:
            return shape.unpack(plain)
        except BadMessage as error:
            kind = COMBINATION if isinstance(error, BadCombination) else MISFIT
            raise _misfit(kind, error.why, error.where) from None

    return Annotated[Any, PlainValidator(unpack), WithJsonSchema(_bounded(shape.json_schema()) | also)]


@dataclass(frozen=True, slots=True)
class BodyField:
    """A field of a body: the attribute that it gives, the type that pydantic checks."""

    attribute: str
    kind: Any
    required: bool = False


def fields_of(
    cls: type, *names: str, without: Iterable[str] = (), also: Mapping[str, JsonSchema] = NOTHING
) -> dict[str, BodyField]:
    """Return fields of a record, all of them or those with these names, under the names that they travel by.

    ``also`` has what the document adds to a field, under its name.
    """
    shape = record_shape(cls)
    return {
        name: BodyField(attributes_of(cls)[name], checked(inner, also.get(name, {})), name not in shape.optional)
        for name, inner in shape.fields
        if (not names or name in names) and name not in without
    }


class _Checked(JsonObject):
    """The fields of a body that have been checked: they are not checked again."""


@dataclass(frozen=True)
class Fields:
    """The content of a body, in ``Annotated[JsonObject, Fields(...)]``: an object of these fields and no others.

    The route receives the fields that were given, by attribute; it knows the others of the record itself.
    Of the fields in ``any_of`` at least one has to be given.
    """

    name: str
    by_name: Mapping[str, BodyField] = field(default_factory=dict)
    any_of: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        fields = core_schema.typed_dict_schema(
            {
                each.attribute: core_schema.typed_dict_field(
                    handler.generate_schema(each.kind), required=each.required, validation_alias=name
                )
                for name, each in self.by_name.items()
            },
            extra_behavior="forbid",
            ref=f"{__name__}.{self.name}:{id(self)}",
        )
        return core_schema.no_info_wrap_validator_function(self._check, fields)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        reference = handler(schema)
        if self.any_of:
            handler.resolve_ref_schema(reference)["anyOf"] = [{"required": [name]} for name in self.any_of]
        return reference

    def _check(self, plain: Any, check: Callable[[Any], JsonObject]) -> _Checked:
        if isinstance(plain, dict) and len(plain) > len(self.by_name) + MAX_TOLD:
            # Pydantic makes an error of each: for 90,000 names that took seconds, in which no other thread ran.
            unknown = islice((name for name in plain if name not in self.by_name), MAX_TOLD + 1)
            plain = {name: plain[name] for name in (*self.by_name, *unknown) if name in plain}
        fields = _check_once(plain, check)
        if self.any_of and not any(self.by_name[name].attribute in fields for name in self.any_of):
            why = f"is missing: give {' or '.join(self.any_of)}"
            raise _misfit(MISFIT, why, (self.any_of[0],))
        return fields


@dataclass(frozen=True)
class Values:
    """The content of a body with free names, in ``Annotated[JsonObject, Values(...)]``: values of one shape."""

    shape: Shape

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        values = handler.generate_schema(checked(MapShape(self.shape)))
        return core_schema.no_info_wrap_validator_function(_check_once, values)


def _misfit(kind: Any, why: str, where: tuple[str, ...]) -> ValidationError:
    details = InitErrorDetails(type=PydanticCustomError(kind, "{why}", {"why": why}), loc=where, input=None)
    return ValidationError.from_exception_data("misfit", [details])


def _check_once(plain: Any, check: Callable[[Any], JsonObject]) -> _Checked:
    return plain if isinstance(plain, _Checked) else _Checked(check(plain))


def _bounded(schema: Any) -> Any:
    """Return a schema that bounds every integer to 64 bits.

    FastAPI makes floats of limits: 2**64 is one, 2**64 - 1 is none.
    """
    if isinstance(schema, list):
        return [_bounded(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    limits = {"minimum": INT_RANGE.start, "exclusiveMaximum": INT_RANGE.stop} if schema.get("type") == "integer" else {}
    return limits | {name: _bounded(each) for name, each in schema.items()}
