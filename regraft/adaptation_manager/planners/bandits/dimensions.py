"""Dimensions that can be varied: a parameter's value, a port's topic, a component's state."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage


class Kind(Enum):
    """The kind of a dimension."""

    PARAMETER = "parameter"
    PORT = "port"
    TRANSITION = "transition"


@dataclass(frozen=True, slots=True)
class Dimension:
    """One thing that can be varied, and between what; constraints know it by ``name``.

    ``member`` is the parameter or port, empty for a transition. ``choices`` are values, topics or transitions' names.
    """

    component: str
    kind: Kind
    member: str
    choices: tuple[PlainValue, ...]
    name: str

    def index_of(self, value: PlainValue) -> int | None:
        """Return where a value stands among the choices, None for any other value."""
        wanted = identity(value)
        return next((index for index, choice in enumerate(self.choices) if identity(choice) == wanted), None)


@dataclass(frozen=True, slots=True)
class Option:
    """One choice for every dimension. Options of equal content have equal keys, however they were listed."""

    key: str
    values: tuple[PlainValue, ...]


def option_of(dimensions: Sequence[Dimension], values: Sequence[PlainValue]) -> Option:
    """Return the option that has ``values`` for ``dimensions``; what they are called is not part of its content."""
    parts = sorted(
        json.dumps([d.component, d.kind.value, d.member]) + identity(value)
        for d, value in zip(dimensions, values, strict=True)
    )
    return Option(hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16], tuple(values))


def identity(value: PlainValue) -> str:
    """Return a text that is equal for equal values: 1 is 1.0, but not true.

    >>> identity(1.0), identity(1), identity(True), identity([0.5, "a"])
    ('1', '1', 'true', '[0.5, "a"]')
    """
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return json.dumps(value)
    try:
        return json.dumps(_whole(value), sort_keys=True)
    except TypeError:
        raise BadMessage(f"holds {type(value).__name__}, must be numbers, texts, or lists of them") from None


def _whole(value: PlainValue) -> PlainValue:
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if isinstance(value, list | tuple):
        return [_whole(part) for part in value]
    if isinstance(value, dict):
        return {key: _whole(part) for key, part in value.items()}
    return value
