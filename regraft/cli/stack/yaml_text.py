"""Writes a document as YAML, with the place of each value as a comment."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator

from regraft.stack.relative_paths import is_in_run_folder
from regraft.stack.yaml.nodes import Node, NumberTooLarge, Scalar, scalar

PLAIN = re.compile(r"[A-Za-z0-9_/$.]([A-Za-z0-9_/$.:-]*[A-Za-z0-9_/$.-])?")
"""Texts that need no quotes: a colon in them has no space behind it."""
WIDTH = 60
"""The column of the comments, where a line is not longer."""


def yaml_text(document: Node) -> str:
    """Return a document as YAML that reads as the same one; each value is followed by its file and line.

    Maps and lists are in lines of their own, so that each scalar has its comment.
    """
    return "\n".join(_lines(document, 0))


def _lines(node: Node, depth: int) -> Iterator[str]:
    indent = "  " * depth
    if isinstance(node.value, dict):
        for key, part in node.value.items():
            yield from _entry(f"{indent}{_written(key)}:", part, depth)
    elif isinstance(node.value, tuple):
        for part in node.value:
            yield from _entry(f"{indent}-", part, depth)


def _entry(start: str, node: Node, depth: int) -> Iterator[str]:
    if isinstance(node.value, dict | tuple) and node.value:
        yield start
        yield from _lines(node, depth + 1)
        return
    # An option may have several lines.
    origin = " ".join(str(node.location).split())
    yield f"{f'{start} {_value(node.value)}':{WIDTH}}  # {origin}"


def _value(value: object) -> str:
    if isinstance(value, dict | tuple):
        return "{}" if isinstance(value, dict) else "[]"
    if isinstance(value, str):
        # The assembly of stacks reads '$$' as a dollar sign that begins no reference.
        return _written(f"${value}" if value.startswith("$") and not is_in_run_folder(value) else value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return json.dumps(value)


def _written(text: str) -> str:
    """Return a text without quotes where it reads as itself, else in quotes.

    >>> _written("module:Class"), _written("yes: no"), _written("12")
    ('module:Class', '"yes: no"', '"12"')
    """
    if PLAIN.fullmatch(text) and _meant(text) == text:
        return text
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in quoted)


def _meant(text: str) -> Scalar:
    try:
        return scalar(text)
    except NumberTooLarge:
        return None
