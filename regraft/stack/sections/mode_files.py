"""Reads the files of ROS 2's system_modes that a stack file, or a robot of it, names as its modes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import Add
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.mode_changes import parameter_problems, unmanaged
from regraft.stack.sections.system_modes import GivenValue, read_system_modes_file
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import StackError
from regraft.stack.yaml.section import Section

PlainChange = dict[str, PlainValue]
Folders = Path | Mapping[str, Path]
MODES = "modes"


@dataclass(slots=True)
class ModesOfFiles:
    """The content of all files: the changes of each mode, the modes that each enters, rules, and the places of rules.

    ``complete`` is whether all files could be read.
    """

    modes: dict[str, list[PlainChange]] = field(default_factory=dict)
    parts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    rules: tuple[ModeRule, ...] = ()
    rule_locations: dict[str, Location] = field(default_factory=dict)
    complete: bool = True


def files_of(given: Node | None) -> dict[str, Node]:
    """Return the files that ``modes`` names, by scope.

    A text is one file. In a map, ``SCOPE/: FILE`` is a file whose names belong to that robot, ``/: FILE`` the stack's.
    """
    if given is None or isinstance(given.value, str):
        return {"": given} if given is not None else {}
    fields = given.value if isinstance(given.value, dict) else {}
    return {key.removesuffix(SHARED): node for key, node in fields.items() if key.endswith(SHARED)}


def modes_of_files(root: Section, components: Mapping[str, ComponentSpec]) -> ModesOfFiles:
    """Return the modes of all files that ``modes`` names; what is wrong is noted.

    Its folder is that of the file that names it; so is that of the files that its modes set.
    """
    found = ModesOfFiles()
    given = root.node(MODES)
    for scope, node in files_of(given).items():
        where = MODES if given is node else f"{MODES}.{scope}{SHARED}"
        if isinstance(node.value, str) and node.value:
            _read(root, node, scope.replace(SHARED, "."), components, found)
        else:
            root.report.add_at(node.location, where, f"must be a file of system_modes, is {node.kind}")
            found.complete = False
    return found


def _read(root: Section, node: Node, scope: str, components: Mapping[str, ComponentSpec], found: ModesOfFiles) -> None:
    folder = node.location.folder
    try:
        read = read_system_modes_file(folder / str(node.value), components, scope)
    except StackError as error:
        root.report.problems += error.problems
        found.complete = False
        return
    for named in read.named:
        if not components[named.component].managed:
            root.report.add_at(named.location, named.field, unmanaged(named.component))
    for value in read.values:
        for path, problem in _value_problems(value, components[value.component], folder):
            root.report.add_at(value.node.location, path, problem)
    for name, changes in read.modes.items():
        assert isinstance(changes, list)
        described = [(change, components.get(change["component"])) for change in changes]
        found.modes[name] = [
            with_absolute_values(change, spec.description if spec else None, folder) for change, spec in described
        ]
    found.parts |= read.parts
    found.rules += read.rules
    found.rule_locations |= read.rule_locations


def _value_problems(value: GivenValue, spec: ComponentSpec, folder: Path) -> Iterator[tuple[str, str]]:
    if spec.description is None:
        return
    values = with_absolute_paths(spec.description, {value.parameter: plain(value.node)}, folder)
    for place, problem in parameter_problems(spec, [spec.description], values):
        yield f"{value.field}{place.removeprefix(value.parameter)}", problem


def with_absolute_values(change: PlainChange, description: Description | None, folders: Folders) -> PlainChange:
    """Return a change with absolute paths in the parameters that it sets, by the description of what it sets."""
    if description is None:
        return change
    if change["change"] == Add.change:
        return {**change, "spec": _with_absolute(change["spec"], description, folders)}
    return _with_absolute(change, description, folders)


def _with_absolute(above: PlainChange, description: Description, folders: Folders) -> PlainChange:
    if not above.get("parameters"):
        return above
    return {**above, "parameters": with_absolute_paths(description, above["parameters"], folders)}
