"""Values and documents as they are typed."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.cli.outcomes import BadInput
from regraft.stack import StackError
from regraft.stack.yaml.document import parse
from regraft.stack.yaml.nodes import Location, Node, NumberTooLarge, plain, scalar

LARGEST = 1024 * 1024


def value_of(text: str, place: str) -> PlainValue:
    """Return what a value typed at a ``place`` means: a YAML scalar, or a list as ``[1, 2]``; raises BadInput."""
    text = text.strip()
    if text[:1] in ("[", "{", "'", '"'):
        return document(text, place)
    try:
        return scalar(text)
    except NumberTooLarge as error:
        raise BadInput(f"{place}: {error}") from None


def assignments(texts: Iterable[str], before: str) -> dict[str, PlainValue]:
    """Return the values of ``name=value ...``; raises BadInput, with ``before`` in front of the name at fault."""
    found: dict[str, PlainValue] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        name = name.strip()
        if not equals or not name:
            raise BadInput(f"{text!r} must look like name=value")
        if name in found:
            raise BadInput(f"{before}{name}: is given twice: leave one out")
        found[name] = value_of(value, f"{before}{name}")
    return found


def document(text: str, shown: str) -> PlainValue:
    """Return the plain data in YAML or JSON text; raises BadInput, calling the text ``shown``."""
    try:
        return plain(parse(text, shown))
    except StackError as error:
        raise BadInput(str(error)) from None


def read_document(file: str) -> PlainValue:
    """Return the plain data in a YAML or JSON file, ``-`` for standard input; raises BadInput."""
    return plain(read_located(file))


def read_located(file: str) -> Node:
    """Return what is in a YAML or JSON file, ``-`` for standard input, with its lines; raises BadInput."""
    shown = "standard input" if file == "-" else file
    try:
        text = _some_of(file).decode()
    except OSError as error:
        raise BadInput(f"{shown}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadInput(f"{shown}: is not UTF-8 text") from None
    try:
        return parse(text, shown)
    except StackError as error:
        raise BadInput(str(error)) from None


def line_of(where: Sequence[str], locations: Mapping[str, Location]) -> str:
    """Return ``file:line`` of a field by its path, or of what holds it; empty if nothing of it is in the file."""
    for length in range(len(where), 0, -1):
        location = locations.get(".".join(where[:length]))
        if location is not None:
            return str(location)
    return ""


def _some_of(file: str) -> bytes:
    """Return all that a file holds, unless it is more than it may be; raises BadInput, OSError."""
    if file == "-":
        data = sys.stdin.buffer.read(LARGEST + 1)
    else:
        with Path(file).open("rb") as stream:
            data = stream.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise BadInput(f"{'standard input' if file == '-' else file}: is more than {LARGEST // 1024} KiB")
    return data
