"""A parameter whose value is a list of records, each an instance of a dataclass."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise
from typing import Any, Generic, TypeVar, overload

from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.component.parameters import HasParameters, Parameter, ParameterError

T = TypeVar("T")


class Records(Parameter[Any], Generic[T]):
    """A parameter that lists records; empty unless it has a default, and read-only: set when the component starts.

    The dataclass defines a record, as for messages: types, bounds and units are checked, absent fields take
    their defaults, and ``__post_init__`` may raise BadMessage. A schedule's records have to be ``in_order_of`` a field,
    which is their time.

    >>> from dataclasses import dataclass
    >>> from regraft import Component
    >>> @dataclass(frozen=True, slots=True)
    ... class Beacon:
    ...     name: str
    ...     rate: float = 1.0
    >>> class Lighthouse(Component):
    ...     "Flashes."
    ...     beacons = Records(Beacon, "what flashes, and how often")
    """

    def __init__(
        self,
        record: type[T],
        description: str = "",
        *,
        default: tuple[T, ...] = (),
        from_robot: str = "",
        in_order_of: str = "",
    ) -> None:
        described: Any = record
        if in_order_of and in_order_of not in {field.name for field in fields(described)}:
            raise TypeError(f"{record.__name__} has no field {in_order_of!r} to be in order of")
        self._in_order_of = in_order_of
        self._shape = record_shape(described)
        super().__init__((), description, read_only=True, from_robot=from_robot)
        self.default = default
        schema = {"type": "array", "items": self._shape.json_schema()}
        self._described = replace(self._described, schema=schema)

    @overload
    def __get__(self, instance: None, owner: type) -> Records[T]: ...

    @overload
    def __get__(self, instance: HasParameters, owner: type) -> tuple[T, ...]: ...

    def __get__(self, instance: HasParameters | None, owner: type) -> Records[T] | tuple[T, ...]:
        """Return the declaration on the class, the records on an instance."""
        value: Any = super().__get__(instance, owner)
        records: Records[T] | tuple[T, ...] = value
        return records

    def checked(self, value: Any) -> tuple[T, ...]:
        """Return the records that plain data represents; raises ParameterError with everything that is wrong."""
        if not isinstance(value, list | tuple):
            raise ParameterError([(self.name, f"must be a list of records, is {type(value).__name__}")])
        records: list[Any] = []
        problems: list[tuple[str, str]] = []
        for index, plain in enumerate(value):
            try:
                records.append(plain if type(plain) is self._shape.cls else self._shape.unpack(plain))
            except BadMessage as error:
                problems.append((".".join([self.name, str(index), *error.where]), error.why))
        if self._in_order_of and not problems:
            problems = self._out_of_order(records)
        if problems:
            raise ParameterError(problems)
        return tuple(records)

    def _out_of_order(self, records: list[Any]) -> list[tuple[str, str]]:
        field = self._in_order_of
        times = [getattr(record, field) for record in records]
        return [
            (f"{self.name}.{index}.{field}", f"{time:g} comes after {before:g}: put the records in order")
            for index, (before, time) in enumerate(pairwise(times), start=1)
            if time < before
        ]

    def plain(self, value: Any) -> Any:
        """Return records as plain data."""
        return [self._shape.pack(record) for record in value]
