"""The files outside of a stack's folder that it names: from the folder of a run, only absolute paths lead there.

Hidden files in it are outside, too: a run does not take them along.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from regraft.bus_schema.annotations import PlainValue
from regraft.evaluation.runs.fingerprint import is_own_code, is_taken_along
from regraft.stack.yaml.document import MAX_FILE_SIZE, read_map
from regraft.stack.yaml.dump import dumped
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import StackError

OUT: Final = re.compile(r"(?:^|/)\.")
"""A part of a path that leads up, or is hidden."""
OUT_IN_YAML: Final = re.compile(rb"(?<!\w)\.|\bcommand\b")
"""Paths that may lead out of a folder, and programs, in a YAML file."""
YAML: Final = (".yaml", ".yml")
CODE: Final = ".py"
COMMAND: Final = "command"
"""The field whose words are those of a program. It runs in the stack's folder, whichever file names it."""
Counts = Callable[[Path], bool]


def with_absolute(value: Any, beside: Path, folder: Path, counts: Counts = os.path.exists) -> Any:
    """Return plain data in which paths that lead out of ``folder`` are absolute, if what is there ``counts``.

    They are relative to ``beside``; words of a command are relative to ``folder``.
    """
    if isinstance(value, Mapping):
        return {
            name: _command(part, folder) if name == COMMAND else with_absolute(part, beside, folder, counts)
            for name, part in value.items()
        }
    if isinstance(value, list | tuple):
        return [with_absolute(part, beside, folder, counts) for part in value]
    if not isinstance(value, str) or (not OUT.search(value) and is_taken_along(beside, folder)):
        return value
    path = _leads_to(value, beside)
    return str(path) if path and not is_taken_along(path, folder) and counts(path) else value


def document_of(node: Node, folder: Path) -> PlainValue:
    """Return a stack as plain data in which the paths of files outside of ``folder`` are absolute.

    Each is relative to the folder of the file that has it. Files of Regraft's own stay as they are: they are code.
    """
    folder_of = cache(lambda file: Location(file).folder)

    def found(node: Node) -> PlainValue:
        if isinstance(node.value, dict):
            return {
                name: _command(plain(part), folder) if name == COMMAND else found(part)
                for name, part in node.value.items()
            }
        if isinstance(node.value, tuple):
            return [found(part) for part in node.value]
        if not isinstance(node.value, str) or not node.location.file:
            return node.value
        beside = folder_of(node.location.file)
        within = not OUT.search(node.value) and is_taken_along(beside, folder)
        path = None if within else _leads_to(node.value, beside)
        if path is None or is_taken_along(path, folder) or is_own_code(path) or not os.path.isfile(path):
            return node.value
        return str(path)

    return found(node)


def lead_out(source: Path, copy: Path) -> None:
    """Have the YAML files of a folder's ``copy`` name what is outside of ``source``, where they were copied from."""
    for file in copy.rglob("*"):
        if file.suffix not in YAML or not file.is_file() or file.stat().st_size > MAX_FILE_SIZE:
            continue
        # The copy of a link is a file of its own; its paths are relative to where it leads.
        beside = (source / file.relative_to(copy)).resolve().parent
        text = file.read_bytes()
        if is_taken_along(beside, source) and not OUT_IN_YAML.search(text):
            continue
        try:
            document = plain(read_map(file))
        except StackError:  # it is of another kind, or nothing that a stack can name
            continue
        changed = with_absolute(document, beside, source)
        if changed != document:
            file.unlink()  # it may be read-only, as its original is
            file.write_text(dumped(changed))


def _command(words: Any, folder: Path) -> Any:
    """Return a program's words, with absolute paths of files that are code, or outside of ``folder``."""
    if not isinstance(words, list | tuple):
        return words
    return [_word(word, folder) if isinstance(word, str) else word for word in words]


def _word(word: str, folder: Path) -> str:
    path = _leads_to(word, folder)
    if path is None or not path.is_file() or (is_taken_along(path, folder) and path.suffix != CODE):
        return word
    return str(path)


def _leads_to(text: str, beside: Path) -> Path | None:
    """Return where a relative path leads, None if the text cannot be one."""
    if not text or os.path.isabs(text) or "\0" in text:
        return None
    return Path(os.path.normpath(beside / text))
