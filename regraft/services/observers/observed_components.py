"""Reads which components are observed, from the file that is generated for MROS2's modes observer."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from regraft.bus_schema.keys import COMPONENT_NAME
from regraft.services.observers.ros_files import read_parameter
from regraft.stack.yaml.nodes import Location, Node
from regraft.stack.yaml.problems import Report

COMPONENTS: Final = "components"
MAX_COMPONENTS: Final = 500


def read_observed_components(file: Path) -> dict[str, Location]:
    """Return the names of the observed components, and the place of each.

    The names are one scalar, split at white space, or a list. ``robot/camera`` is the component ``robot.camera``.
    Raises StackError with all that is wrong.
    """
    node, path, report = read_parameter(file, COMPONENTS)
    found: dict[str, Location] = {}
    for name, location in _names(node, path, report):
        component = name.strip("/").replace("/", ".")
        if not COMPONENT_NAME.fullmatch(component):
            report.add_at(
                location, path, f"{name!r} is no component's name: must be such as 'camera' or 'robot/camera'"
            )
        elif component in found:
            report.add_at(location, path, f"{component!r} is given twice, first in line {found[component].line}")
        else:
            found[component] = location
    if len(found) > MAX_COMPONENTS:
        report.add(path, f"has {len(found)} names, must have at most {MAX_COMPONENTS}")
    report.raise_if_any()
    return found


def _names(node: Node, path: str, report: Report) -> Iterator[tuple[str, Location]]:
    if isinstance(node.value, str):
        yield from ((name, node.location) for name in node.value.split())
    elif isinstance(node.value, tuple):
        for part in node.value:
            if isinstance(part.value, str):
                yield part.value, part.location
            else:
                report.add_at(part.location, path, f"must be a name, is {part.kind}")
    else:
        report.add(path, f"must be names, as one text or a list, is {node.kind}")
