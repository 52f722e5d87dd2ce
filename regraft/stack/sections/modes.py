"""Reads the modes of a stack file: named sets of changes, each done as one adaptation."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationRequest, Add, EnterMode, SetParameters
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.suggestions import instead_of, no_such
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.system_modes import read_system_modes_file
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.problems import StackError
from regraft.stack.yaml.section import Section


def with_modes(root: Section, architecture: Architecture) -> Architecture:
    """Return the architecture with the modes of ``modes``; they speak of its components.

    ``modes`` may name a file of ROS 2's system_modes. That is looked for from the folder of the file that names it, and
    so is what its modes set.
    """
    given = root.node("modes")
    components = architecture.components
    if given is not None and isinstance(given.value, str):
        folder = given.location.folder
        try:
            read = read_system_modes_file(folder / given.value, components)
        except StackError as error:
            root.report.problems += error.problems
            return architecture
        modes = {name: _with_absolute_paths(changes, components, folder) for name, changes in read.modes.items()}
        return replace(architecture, modes=modes, mode_parts=read.parts, mode_rules=read.rules)
    section = root.section("modes")
    found: dict[str, list[dict[str, PlainValue]]] = {}
    for name in section.names():
        node = section.node(name)
        changes = plain(node) if node else None
        problem = _problem(changes, components)
        if problem:
            section.wrong(name, problem)
        else:
            found[name] = _with_absolute_paths(changes, components, section.location(name).folder)
    return _unfolded(section, found, architecture)


def _unfolded(
    section: Section, found: Mapping[str, list[dict[str, PlainValue]]], architecture: Architecture
) -> Architecture:
    """Return the architecture with modes that have the changes of those that they enter in their places."""
    parts = {name: tuple(c["mode"] for c in changes if _enters(c)) for name, changes in found.items()}
    modes: dict[str, PlainValue] = {}
    for name in found:
        problem = _entering_problem(name, parts, section.names())
        if problem:
            section.wrong(name, problem)
        else:
            modes[name] = _flat(name, found)
    return replace(architecture, modes=modes, mode_parts={name: each for name, each in parts.items() if each})


def _enters(change: Mapping[str, PlainValue]) -> bool:
    return bool(change["change"] == EnterMode.change)


def _flat(name: str, found: Mapping[str, list[dict[str, PlainValue]]]) -> list[dict[str, PlainValue]]:
    return [one for change in found[name] for one in (_flat(change["mode"], found) if _enters(change) else [change])]


def _entering_problem(
    name: str, parts: Mapping[str, tuple[str, ...]], known: Collection[str], above: tuple[str, ...] = ()
) -> str | None:
    """Return why the modes that a mode enters cannot be entered; None if they can."""
    if name in above:
        return f"enters itself: {' > '.join((*above, name))}"
    if name not in known:
        return no_such("mode", name, known)
    if name not in parts:
        return f"enters {name!r}, which is wrong"
    problems = (_entering_problem(inner, parts, known, (*above, name)) for inner in parts[name])
    return next((problem for problem in problems if problem), None)


def _with_absolute_paths(
    changes: PlainValue, components: Mapping[str, ComponentSpec], folder: Path
) -> list[dict[str, PlainValue]]:
    assert isinstance(changes, list)
    return [_absolute(change, components, folder) for change in changes]


def _absolute(
    change: dict[str, PlainValue], components: Mapping[str, ComponentSpec], folder: Path
) -> dict[str, PlainValue]:
    spec = components.get(change.get("component", ""))
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
    known = {*components, *(change.component for change in meant if isinstance(change, Add))}
    for change in meant:
        if change.component not in known and not isinstance(change, EnterMode):
            return f"there is no component {change.component!r}; {instead_of(change.component, known)}"
    return None
