"""Reads one value out of a message of any type: a field by its dotted path, and what is made of it.

``twist.linear.x`` is a field of a field, ``consumers.motors`` a key of a map. ``ranges.0`` is one of many, and
``faults.text`` that field of each of many. ``reading_checks`` checks beforehand what a type has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from typing import Annotated, Any

import numpy as np

from regraft.bus_schema.annotations import PlainValue, Text
from regraft.bus_schema.encoding.records import attributes_of
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage


class Reduce(Enum):
    """How a field is reduced: a number to its absolute value, many numbers to one, many things to their count or text.

    ``norm`` is the Euclidean length of a vector. ``min``, ``max`` and ``mean`` leave out what is not finite. ``text``
    joins many by ``; ``.
    """

    ABS = "abs"
    NORM = "norm"
    MIN = "min"
    MAX = "max"
    MEAN = "mean"
    LENGTH = "length"
    TEXT = "text"


NEEDED = {
    None: "a number, truth value or text, or a list of them",
    Reduce.ABS: "a number",
    Reduce.NORM: "a record, list or array of numbers",
    Reduce.MIN: "a list, map or array of numbers",
    Reduce.MAX: "a list, map or array of numbers",
    Reduce.MEAN: "a list, map or array of numbers",
    Reduce.LENGTH: "a list, map, array or text",
    Reduce.TEXT: "text or a number, or a list of them",
}
"""The form that each reduction needs of a field."""


@message("regraft/Reading")
@dataclass(frozen=True, slots=True)
class Reading:
    """A field of a message and what is made of it.

    ``at_least`` has ``min``, ``max`` and ``mean`` leave out smaller numbers. ``if_none`` is the value where there is
    none: the field is empty, or no number is left.
    """

    field: Annotated[str, Text(200)]
    reduce: Reduce | None = None
    at_least: float | None = None
    if_none: float | None = None


def read(said: object, reading: Reading) -> PlainValue:
    """Return the value in a message: a bool, int, float, text, or a list of these; None where there is none.

    Raises:
        BadMessage: the field is something that ``reading_problem`` would have refused, or its plain data is.
    """
    value = _at(said, reading.field.split("."))
    if value is not None:
        value = _MAKERS[reading.reduce](value, reading)
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return reading.if_none
    return value


def is_index(part: str) -> bool:
    """Return whether a part of a path is an index, not a name."""
    return part.isascii() and part.isdigit()


def _at(value: Any, path: list[str]) -> Any:
    for index, part in enumerate(path):
        if isinstance(value, list | tuple) and not is_index(part):
            return [_at(item, path[index:]) for item in value]
        value = _part(value, part)
    return value


def _part(value: Any, part: str) -> Any:
    if isinstance(value, dict):
        return value.get(part)
    if isinstance(value, list | tuple | np.ndarray):
        item = value[int(part)] if is_index(part) and int(part) < len(value) else None
        return item.item() if isinstance(item, np.generic) else item
    if not is_dataclass(value):
        return None
    attribute = attributes_of(value.__class__).get(part)
    return getattr(value, attribute) if attribute is not None else None


def _plain(value: Any, reading: Reading) -> PlainValue:
    if isinstance(value, list | tuple):
        return [_plain(item, reading) for item in value if item is not None]
    if isinstance(value, Enum):
        value = value.value
    if not isinstance(value, bool | int | float | str):
        raise _misfit(value, reading)
    return value


def _absolute(value: Any, reading: Reading) -> PlainValue:
    if not _is_number(value):
        raise _misfit(value, reading)
    return abs(value)


def _norm(value: Any, reading: Reading) -> PlainValue:
    return math.hypot(*_numbers(value, reading).tolist())


def _one_of_many(make: Callable[[Any], Any]) -> Callable[[Any, Reading], PlainValue]:
    def made(value: Any, reading: Reading) -> PlainValue:
        numbers = _numbers(value, reading)
        numbers = numbers[np.isfinite(numbers)]
        if reading.at_least is not None:
            numbers = numbers[numbers >= reading.at_least]
        with np.errstate(over="ignore"):
            return float(make(numbers)) if numbers.size else None

    return made


def _length(value: Any, reading: Reading) -> PlainValue:
    if not isinstance(value, list | tuple | dict | str | np.ndarray):
        raise _misfit(value, reading)
    return len(value)


def _text(value: Any, reading: Reading) -> PlainValue:
    plain = _plain(value, reading)
    return "; ".join(map(str, plain)) if isinstance(plain, list) else str(plain)


_MAKERS: dict[Reduce | None, Callable[[Any, Reading], PlainValue]] = {
    None: _plain,
    Reduce.ABS: _absolute,
    Reduce.NORM: _norm,
    Reduce.MIN: _one_of_many(np.min),
    Reduce.MAX: _one_of_many(np.max),
    Reduce.MEAN: _one_of_many(np.mean),
    Reduce.LENGTH: _length,
    Reduce.TEXT: _text,
}


def _numbers(value: Any, reading: Reading) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return many numbers as an array of one dimension."""
    if isinstance(value, np.ndarray):
        with np.errstate(invalid="ignore"):  # a signalling NaN becomes a quiet one
            return value.astype(np.float64).reshape(-1)
    if is_dataclass(value):
        many = [getattr(value, field.name) for field in fields(value)]
    elif isinstance(value, dict):
        many = list(value.values())
    elif isinstance(value, list | tuple):
        many = list(value)
    else:
        raise _misfit(value, reading)
    present = [number for number in many if number is not None]
    if not all(map(_is_number, present)):
        raise _misfit(value, reading)
    return np.array(present, np.float64)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _misfit(value: Any, reading: Reading) -> BadMessage:
    return BadMessage(f"field {reading.field!r} is {type(value).__name__}, must be {NEEDED[reading.reduce]}")
