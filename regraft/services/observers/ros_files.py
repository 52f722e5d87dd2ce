"""Reads what a file of ROS 2 parameters has for an observer: one parameter of one node.

The layout is that of the published files of MROS2: the node's name, ``ros__parameters``, the parameter.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from regraft.bus_schema.suggestions import instead_of
from regraft.stack.yaml.document import parse
from regraft.stack.yaml.nodes import Node, locations_of
from regraft.stack.yaml.path_hints import instead_of_path
from regraft.stack.yaml.problems import Report, fail

MAX_SIZE: Final = 64 * 1024
"""Bytes of a file."""
PARAMETERS: Final = "ros__parameters"


def read_parameter(file: Path, name: str) -> tuple[Node, str, Report]:
    """Return the value of a parameter, its path in the file, and a report that knows the file's lines.

    Raises StackError.
    """
    document = parse(_text(file, name), str(file))
    report = Report(str(file), locations_of(document))
    nodes = document.value if isinstance(document.value, dict) else {}
    if len(nodes) != 1:
        found = f"has {len(nodes)} nodes" if nodes else f"is {document.kind}"
        fail(str(file), document.location.line, f"{found}, must be one node with '{PARAMETERS}' and '{name}'")
    ((node, body),) = nodes.items()
    parameters = _only(body, node, PARAMETERS, report)
    path = f"{node}.{PARAMETERS}"
    return _only(parameters, path, name, report), f"{path}.{name}", report


def _only(node: Node, path: str, name: str, report: Report) -> Node:
    """Return the only field of a map; raises StackError if it has others, or not this one."""
    fields = node.value if isinstance(node.value, dict) else {}
    for key in fields:
        if key != name:
            report.add(f"{path}.{key}", f"there is no such field; {instead_of(key, [name])}")
    if not fields:
        report.add(path, f"is {node.kind}, must be a map with '{name}'")
    report.raise_if_any()
    return fields[name]


def _text(file: Path, name: str) -> str:
    shown = str(file)
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_SIZE + 1)
    except FileNotFoundError:
        fail(shown, None, f"there is no such file{instead_of_path(file)}")
    except (OSError, ValueError) as error:
        fail(shown, None, f"cannot be read: {getattr(error, 'strerror', None) or error}")
    if len(data) > MAX_SIZE:
        fail(shown, None, f"has more than {MAX_SIZE // 1024} KiB: must have at most these")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        fail(shown, line, f"is not UTF-8 text: byte 0x{data[error.start]:02x} does not belong there")
    if not any(line.strip() and not line.lstrip().startswith(("#", "---")) for line in text.splitlines()):
        fail(shown, None, f"is empty: must be a node with '{PARAMETERS}' and '{name}'")
    return text
