"""Reads a YAML file of any content into nodes; anything that cannot be read is a StackError."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from regraft.stack.installed import instead_of_stack
from regraft.stack.yaml.nodes import Location, Node, NumberTooLarge, Scalar, locations_of, scalar
from regraft.stack.yaml.path_hints import instead_of_path
from regraft.stack.yaml.problems import Report, fail

MAX_FILE_SIZE = 256 * 1024
MAX_NODES = 20_000
DEEPEST = 32
MAX_KEY_LENGTH = 1024
"""Characters of a key on one line, as YAML has it."""
MAX_SHOWN_LENGTH = 40

PLAIN_TAGS = frozenset(f"tag:yaml.org,2002:{kind}" for kind in ("str", "seq", "map"))


class _ShallowLoader(yaml.BaseLoader):
    """Gives deep nesting up early, however deeply Python lets functions call each other."""

    depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        self.depth += 1
        if self.depth > 2 * DEEPEST:
            raise RecursionError
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


def read_document(file: Path) -> tuple[Node, Report]:
    """Return the map that a file holds, and a report that knows the lines of its fields; raises StackError."""
    document = read_map(file)
    return document, Report(str(file), locations_of(document))


def read_map(file: Path, fields: str = "fields such as 'system' and 'components'") -> Node:
    """Return the map of ``fields`` that a file holds; raises StackError."""
    document = parse(_text(file), str(file))
    if not isinstance(document.value, dict):
        fail(*document.location, f"must be a map of {fields}, is {document.kind}")
    return document


def parse(text: str, file: str) -> Node:
    """Return what YAML text means; problems name ``file``; raises StackError."""
    try:
        root = yaml.compose(text, Loader=_ShallowLoader)
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        fail(file, line, f"holds the character U+{ord(text[error.position]):04X}, which YAML does not allow")
    except yaml.MarkedYAMLError as error:
        _fail_at(error, text, file)
    except RecursionError:
        fail(file, None, f"is nested too deeply: must have at most {DEEPEST} levels")
    except (ValueError, OverflowError) as error:  # of numbers in escapes and directives, which PyYAML does not check
        fail(file, None, f"is not YAML: it holds a number that is too large ({error})")
    if root is None:
        fail(file, None, "is empty: it must be a map of fields")
    conversion = _Conversion(file)
    node = conversion.node(root, "", 0)
    conversion.report.raise_if_any()
    return node


def _text(file: Path) -> str:
    shown = str(file)
    try:
        if file.is_dir():
            inside = file / "stack.yaml"
            hint = f": did you mean {inside}?" if inside.is_file() else ", must be a stack file"
            fail(shown, None, f"is a folder{hint}")
        if file.exists() and not file.is_file():
            fail(shown, None, "is not an ordinary file")
        with file.open("rb") as stream:
            data = stream.read(MAX_FILE_SIZE + 1)
    except FileNotFoundError:
        fail(shown, None, f"there is no such file{instead_of_path(file) or instead_of_stack(file)}")
    except (OSError, ValueError) as error:
        fail(shown, None, f"cannot be read: {getattr(error, 'strerror', None) or error}")
    if len(data) > MAX_FILE_SIZE:
        fail(shown, None, f"is too large for a stack file: must be at most {MAX_FILE_SIZE // 1024} KiB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        fail(shown, line, f"is not UTF-8 text: byte 0x{data[error.start]:02x} does not belong there")


def _fail_at(error: yaml.MarkedYAMLError, text: str, file: str) -> None:
    mark = error.problem_mark or error.context_mark
    if mark is None:
        fail(file, None, f"is not YAML: {error.problem or error.context}")
    cause = _known_cause(text, mark)
    if cause:
        fail(file, mark.line + 1, f"is not YAML: {cause}")
    context = f"{error.context}: " if error.context else ""
    fail(file, mark.line + 1, f"is not YAML: {context}{error.problem} (column {mark.column + 1})")


def _known_cause(text: str, mark: yaml.Mark) -> str | None:
    """Return what is wrong where YAML's own words mislead, None elsewhere."""
    line = text[: mark.index].rpartition("\n")[2]
    if text[mark.index : mark.index + 1] == "\t":
        before = line.split()
        if not before:
            return f"a tab in the indentation (column {mark.column + 1}): must be spaces"
        return f"a tab after {before[-1][-MAX_SHOWN_LENGTH:]!r} (column {mark.column + 1}): must be a space"
    key = line.split(" ")[-1].lstrip("{[,")
    if text[mark.index : mark.index + 1] == ":" and len(key) > MAX_KEY_LENGTH:
        column = mark.column + 1 - len(key)
        return f"a key of {len(key)} characters (column {column}): must be at most {MAX_KEY_LENGTH}"
    return None


@dataclass(slots=True)
class _Conversion:
    """Turns YAML's nodes into ours; the target of an alias counts each time, so that no file can swell."""

    file: str
    report: Report = field(init=False)
    count: int = 0

    def __post_init__(self) -> None:
        self.report = Report(self.file)

    def node(self, raw: yaml.Node, path: str, depth: int) -> Node:
        location = Location(self.file, raw.start_mark.line + 1)
        self.count += 1
        if self.count > MAX_NODES:
            fail(*location, f"holds more than {MAX_NODES} values, counting what aliases stand for")
        if depth > DEEPEST:
            fail(*location, f"is nested too deeply: must have at most {DEEPEST} levels")
        if raw.tag not in PLAIN_TAGS:
            self.report.add_at(location, path, f"the tag {raw.tag!r} is not known here: leave it out")
        if isinstance(raw, yaml.MappingNode):
            return Node(self._map(raw, path, depth), location)
        if isinstance(raw, yaml.SequenceNode):
            parts = (self.node(part, f"{path}.{index}", depth + 1) for index, part in enumerate(raw.value))
            return Node(tuple(parts), location)
        quoted = isinstance(raw, yaml.ScalarNode) and raw.style
        return Node(raw.value if quoted else self._scalar(raw.value, path, location), location)

    def _scalar(self, text: str, path: str, location: Location) -> Scalar:
        try:
            return scalar(text)
        except NumberTooLarge as error:
            self.report.add_at(location, path, str(error))
            return None

    def _map(self, raw: yaml.MappingNode, path: str, depth: int) -> dict[str, Node]:
        found: dict[str, Node] = {}
        for key, value in raw.value:
            location = Location(self.file, key.start_mark.line + 1)
            if not isinstance(key, yaml.ScalarNode):
                self.report.add_at(location, path, "a key must be a name, not a list or a map")
                continue
            here = f"{path}.{key.value}" if path else key.value
            if key.value in found:
                first = found[key.value].location.line
                self.report.add_at(location, here, f"is given twice, first in line {first}: leave one out")
                continue
            # A field's line is that of its key, not that where its value begins.
            found[key.value] = Node(self.node(value, here, depth + 1).value, location)
        return found
