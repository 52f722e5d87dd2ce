"""Values of YAML files, with their lines.

Unquoted scalars have their meaning in YAML 1.2's core schema: ``yes``, ``on`` and ``12:30`` are texts, ``1e-3`` is a
number.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeAlias

from regraft.bus_schema.annotations import PlainValue

Scalar: TypeAlias = bool | int | float | str | None

INTEGER = re.compile(r"[-+]?[0-9]+")
BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
SPECIAL = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
NULL = ("", "~", "null", "Null", "NULL")
TRUE = ("true", "True", "TRUE")
FALSE = ("false", "False", "FALSE")


MAX_WHOLE = 30
"""Characters of a whole number that is read exactly: a longer one fits into no field, and is read as a float."""
MAX_SHOWN_LENGTH = 40


class NumberTooLarge(ValueError):
    """A scalar is a number beyond what a float can be; the text states it."""

    def __init__(self, text: str) -> None:
        shown = text if len(text) <= MAX_SHOWN_LENGTH else f"{text[:MAX_SHOWN_LENGTH]}... ({len(text)} characters)"
        super().__init__(f"{shown} is too large for a number: it goes to about 1.8e308; a text stands in quotes")


class Location(NamedTuple):
    """A file, or a name in place of one, and a line of it (from 1); None for the whole of it."""

    file: str
    line: int | None = None

    def __str__(self) -> str:
        """Return ``frog/base.yaml:12``."""
        return self.file if self.line is None else f"{self.file}:{self.line}"

    @property
    def folder(self) -> Path:
        """The folder of the file, from which the relative paths in it are looked for."""
        return Path(self.file).resolve().parent


NOWHERE = Location("")


@dataclass(frozen=True, slots=True)
class Node:
    """A scalar, a list or a map, and the place of it, or of its key; ``referred`` if a reference stood there."""

    value: Scalar | tuple[Node, ...] | dict[str, Node]
    location: Location = NOWHERE
    referred: bool = field(default=False, compare=False)

    @property
    def kind(self) -> str:
        """Return in words what it is."""
        kinds = {dict: "a map", tuple: "a list", str: "a text", bool: "true or false", type(None): "nothing"}
        return kinds.get(type(self.value), "a number")


def scalar(text: str) -> Scalar:
    """Return what an unquoted scalar means; raises NumberTooLarge."""
    if text in NULL:
        return None
    if text in TRUE or text in FALSE:
        return text in TRUE
    if len(text) <= MAX_WHOLE and INTEGER.fullmatch(text):
        return int(text)
    if SPECIAL.fullmatch(text):
        return float(text.replace(".", ""))
    if BASED.fullmatch(text):
        return _based(text)
    if not FLOAT.fullmatch(text):
        return text
    number = float(text)
    if math.isinf(number):
        raise NumberTooLarge(text)
    return number


def _based(text: str) -> int | float:
    number = int(text, 0)
    if len(text) <= MAX_WHOLE:
        return number
    try:
        return float(number)
    except OverflowError:
        raise NumberTooLarge(text) from None


def plain(node: Node) -> PlainValue:
    """Return the value without its lines."""
    if isinstance(node.value, dict):
        return {key: plain(part) for key, part in node.value.items()}
    if isinstance(node.value, tuple):
        return [plain(part) for part in node.value]
    return node.value


def moved(node: Node, location: Location) -> Node:
    """Return the value with all of it at one location."""
    if isinstance(node.value, dict):
        return Node({key: moved(part, location) for key, part in node.value.items()}, location)
    if isinstance(node.value, tuple):
        return Node(tuple(moved(part, location) for part in node.value), location)
    return Node(node.value, location)


def size_of(node: Node) -> int:
    """Return of how many values a value consists, itself included."""
    return 1 + sum(map(size_of, _parts(node).values()))


def locations_of(node: Node) -> dict[str, Location]:
    """Return the place of every field, by its dotted path; list items count from 0."""
    locations: dict[str, Location] = {}
    _note_locations(node, "", locations)
    return locations


def _note_locations(node: Node, path: str, locations: dict[str, Location]) -> None:
    if path:
        locations.setdefault(path, node.location)
    for key, part in _parts(node).items():
        _note_locations(part, f"{path}.{key}" if path else key, locations)


def _parts(node: Node) -> dict[str, Node]:
    if isinstance(node.value, tuple):
        return {str(index): part for index, part in enumerate(node.value)}
    return node.value if isinstance(node.value, dict) else {}
