"""Values of a YAML file that still know their lines.

Unquoted scalars mean what YAML 1.2's core schema says: ``yes``, ``on`` and ``12:30`` are texts, ``1e-3`` is a
number.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TypeAlias

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
    """A scalar is a number beyond what a float can be; the text says so."""

    def __init__(self, text: str) -> None:
        shown = text if len(text) <= MAX_SHOWN_LENGTH else f"{text[:MAX_SHOWN_LENGTH]}... ({len(text)} characters)"
        super().__init__(f"{shown} is too large for a number: it goes to about 1.8e308; a text stands in quotes")


@dataclass(frozen=True, slots=True)
class Node:
    """A scalar, a list or a map, and the line (from 1) where it, or its key, stands."""

    value: Scalar | tuple[Node, ...] | dict[str, Node]
    line: int

    @property
    def kind(self) -> str:
        """Say in words what it is."""
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


def lines_of(node: Node) -> dict[str, int]:
    """Return the line of every field by its dotted path; list items count from 0."""
    lines: dict[str, int] = {}
    _note_lines(node, "", lines)
    return lines


def _note_lines(node: Node, path: str, lines: dict[str, int]) -> None:
    if path:
        lines.setdefault(path, node.line)
    parts: dict[str, Node] = {}
    if isinstance(node.value, dict):
        parts = node.value
    elif isinstance(node.value, tuple):
        parts = {str(index): part for index, part in enumerate(node.value)}
    for key, part in parts.items():
        _note_lines(part, f"{path}.{key}" if path else key, lines)
