"""Values and documents as they are typed."""

from __future__ import annotations

import sys
from pathlib import Path

from bus_schema.annotations import PlainValue
from regraft.cli.group import BadInput
from regraft.stack import StackError
from regraft.stack.document import parse
from regraft.stack.nodes import plain, scalar

LARGEST = 1024 * 1024


def value_of(text: str) -> PlainValue:
    """Return what a typed value means: a YAML scalar, or a list as ``[1, 2]``; raises BadInput."""
    text = text.strip()
    if text[:1] not in ("[", "{", "'", '"'):
        return scalar(text)
    return document(text, "value")


def assignment(text: str) -> tuple[str, PlainValue]:
    """Return name and value of ``name=value``; raises BadInput."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        raise BadInput(f"{text!r} must look like name=value")
    return name.strip(), value_of(value)


def document(text: str, shown: str) -> PlainValue:
    """Return the plain data in YAML or JSON text; raises BadInput, calling the text ``shown``."""
    try:
        return plain(parse(text, shown))
    except StackError as error:
        raise BadInput(str(error)) from None


def read_document(file: str) -> PlainValue:
    """Return the plain data in a YAML or JSON file, ``-`` for standard input; raises BadInput."""
    if file == "-":
        return document(sys.stdin.read(LARGEST), "standard input")
    try:
        text = Path(file).read_text(encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{file}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadInput(f"{file}: is not UTF-8 text") from None
    if len(text) > LARGEST:
        raise BadInput(f"{file}: is too large: must be at most {LARGEST // 1024} KiB")
    return document(text, file)
