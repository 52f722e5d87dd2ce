"""Reads the modes of a stack file: named sets of changes, each done as one adaptation."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationRequest, Add, EnterMode, SetParameters
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.system_modes import read_system_modes
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.problems import StackError
from regraft.stack.yaml.section import Section


def read_modes(root: Section, components: Mapping[str, ComponentSpec]) -> dict[str, PlainValue]:
    """Return the changes of each mode of ``modes`` as plain data; they speak of ``components``.

    ``modes`` may name a file of ROS 2's system_modes. That is looked for from the folder of the file that names it, and
    so is what its modes set.
    """
    given = root.node("modes")
    if given is not None and isinstance(given.value, str):
        folder = given.location.folder
        try:
            modes = read_system_modes(folder / given.value, components)
        except StackError as error:
            root.report.problems += error.problems
            return {}
        return {name: _with_absolute_paths(changes, components, folder) for name, changes in modes.items()}
    section = root.section("modes")
    found = {}
    for name in section.names():
        node = section.node(name)
        changes = plain(node) if node else None
        problem = _problem(changes, components)
        if problem:
            section.wrong(name, problem)
        else:
            found[name] = _with_absolute_paths(changes, components, section.location(name).folder)
    return found


def _with_absolute_paths(
    changes: PlainValue, components: Mapping[str, ComponentSpec], folder: Path
) -> list[dict[str, PlainValue]]:
    assert isinstance(changes, list)
    return [_absolute(change, components, folder) for change in changes]


def _absolute(
    change: dict[str, PlainValue], components: Mapping[str, ComponentSpec], folder: Path
) -> dict[str, PlainValue]:
    spec = components.get(change["component"])
    if change["change"] != SetParameters.change or spec is None or spec.description is None:
        return change
    return {**change, "parameters": with_absolute_paths(spec.description, change["parameters"], folder)}


def _problem(changes: PlainValue, components: Collection[str]) -> str | None:
    if not isinstance(changes, list) or not changes:
        return "must be a list of changes, as an adaptation has them"
    try:
        meant = codec.from_plain({"changes": changes}, AdaptationRequest).changes
    except BadMessage as error:
        return str(error)
    if any(isinstance(change, EnterMode) for change in meant):
        return "enters another mode: must name the changes themselves"
    known = {*components, *(change.component for change in meant if isinstance(change, Add))}
    for change in meant:
        if change.component not in known:
            return f"there is no component {change.component!r}; {instead_of(change.component, known)}"
    return None
