"""The files outside of a stack's folder that it names: from the folder of a run, only absolute paths lead there."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from regraft.bus_schema.annotations import PlainValue
from regraft.process.own_python import INSTALLED_IN
from regraft.stack.yaml.document import MAX_FILE_SIZE, read_map
from regraft.stack.yaml.dump import dumped
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import StackError

UP: Final = ".."
YAML: Final = (".yaml", ".yml")
NO_PATHS: Final = "command"
"""The field whose words are those of a program, which runs in a folder of its own."""
Counts = Callable[[Path], bool]


def with_absolute(value: Any, beside: Path, folder: Path, counts: Counts = os.path.exists) -> Any:
    """Return plain data in which paths that lead out of ``folder`` are absolute, if what is there ``counts``.

    They are relative to ``beside``, which is in that folder.
    """
    if isinstance(value, Mapping):
        return {
            name: part if name == NO_PATHS else with_absolute(part, beside, folder, counts)
            for name, part in value.items()
        }
    if isinstance(value, list | tuple):
        return [with_absolute(part, beside, folder, counts) for part in value]
    if not isinstance(value, str) or UP not in value:
        return value
    path = _leads_to(value, beside)
    return str(path) if path and not path.is_relative_to(folder) and counts(path) else value


def document_of(node: Node, folder: Path) -> PlainValue:
    """Return a stack as plain data in which the paths of files outside of ``folder`` are absolute.

    Each is relative to the folder of the file that has it. Installed files stay as they are: they are code.
    """
    folder_of = cache(lambda file: Location(file).folder)

    def found(node: Node) -> PlainValue:
        if isinstance(node.value, dict):
            return {name: plain(part) if name == NO_PATHS else found(part) for name, part in node.value.items()}
        if isinstance(node.value, tuple):
            return [found(part) for part in node.value]
        if not isinstance(node.value, str) or not node.location.file:
            return node.value
        beside = folder_of(node.location.file)
        path = _leads_to(node.value, beside) if UP in node.value or not beside.is_relative_to(folder) else None
        if path is None or path.is_relative_to(folder) or path.is_relative_to(INSTALLED_IN) or not os.path.isfile(path):
            return node.value
        return str(path)

    return found(node)


def lead_out(source: Path, copy: Path) -> None:
    """Have the YAML files of a folder's ``copy`` name what is outside of ``source``, where they were copied from."""
    for file in copy.rglob("*"):
        if file.suffix not in YAML or not file.is_file() or file.stat().st_size > MAX_FILE_SIZE:
            continue
        if UP.encode() not in file.read_bytes():
            continue
        beside = source / file.relative_to(copy).parent
        try:
            document = plain(read_map(file))
        except StackError:  # it is of another kind, or nothing that a stack can name
            continue
        changed = with_absolute(document, beside.resolve(), source)
        if changed != document:
            file.write_text(dumped(changed))


def _leads_to(text: str, beside: Path) -> Path | None:
    """Return where a relative path leads, None if the text cannot be one."""
    if not text or os.path.isabs(text) or "\0" in text:
        return None
    return Path(os.path.normpath(beside / text))
