"""Reads the modes of a stack file: named sets of changes, each done as one adaptation."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationRequest, Add, Change, EnterMode, SetParameters
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.consistency import contradictions
from regraft.bus_schema.suggestions import no_such
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.mode_changes import change_problems, parameter_problems, targets_of
from regraft.stack.sections.system_modes import GivenValue, read_system_modes_file
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import StackError
from regraft.stack.yaml.section import Section

PlainChange = dict[str, PlainValue]
MODES = "modes"


@dataclass(frozen=True, slots=True)
class ReadModes:
    """An architecture with its modes; ``names_known`` is whether the names of all modes are.

    ``rule_locations`` are the places of rules that a file of system_modes has, by name.
    """

    architecture: Architecture
    names_known: bool
    rule_locations: Mapping[str, Location] = field(default_factory=dict)


def with_modes(root: Section, architecture: Architecture, refused: Collection[str] = ()) -> ReadModes:
    """Return the architecture with the modes of ``modes``.

    The modes speak of its components. One that is wrong is noted, and has the changes that are right. ``modes`` may
    name a file of ROS 2's system_modes. That is looked for from the folder of the file that names it, and so is what
    its modes set. Modules that are ``refused`` are not imported.
    """
    given = root.node(MODES)
    if given is not None and isinstance(given.value, str):
        return _of_file(root, given, architecture)
    section = root.section(MODES)
    read = {name: _changes(section, name, architecture.components) for name in section.names()}
    targets = targets_of(architecture, (meant for changes in read.values() for _, meant, _ in changes), refused)
    for changes in read.values():
        for place, meant, _ in changes:
            for below, problem in change_problems(meant, targets):
                section.wrong(f"{place}.{below}", problem)
    for changes in read.values():
        for twice in contradictions([meant for _, meant, _ in changes]):
            section.wrong(f"{changes[twice.change or 0][0]}.{twice.field}", twice.problem)
    found = {name: {place: whole for place, _, whole in changes} for name, changes in read.items()}
    _check_entered(section, found)
    known = given is None or given.value is None or isinstance(given.value, dict)
    whole = {name: list(changes.values()) for name, changes in found.items()}
    return ReadModes(_unfolded(whole, architecture), known)


def _of_file(root: Section, given: Node, architecture: Architecture) -> ReadModes:
    """Return the architecture with the modes of a file of system_modes."""
    components, folder = architecture.components, given.location.folder
    try:
        read = read_system_modes_file(folder / str(given.value), components)
    except StackError as error:
        root.report.problems += error.problems
        return ReadModes(architecture, names_known=False)
    for value in read.values:
        for path, problem in _value_problems(value, components[value.component], folder):
            root.report.add_at(value.node.location, path, problem)
    modes = {name: _with_absolute_paths(changes, components, folder) for name, changes in read.modes.items()}
    architecture = replace(architecture, modes=modes, mode_parts=read.parts, mode_rules=read.rules)
    return ReadModes(architecture, names_known=True, rule_locations=read.rule_locations)


def _value_problems(value: GivenValue, spec: ComponentSpec, folder: Path) -> Iterator[tuple[str, str]]:
    if spec.description is None:
        return
    values = with_absolute_paths(spec.description, {value.parameter: plain(value.node)}, folder)
    for place, problem in parameter_problems(spec, [spec.description], values):
        yield f"{value.field}{place.removeprefix(value.parameter)}", problem


def _changes(
    section: Section, name: str, components: Mapping[str, ComponentSpec]
) -> list[tuple[str, Change, PlainChange]]:
    """Return the changes of a mode that can be read: the field of each, its meaning, and it with absolute paths."""
    node = section.node(name)
    changes = plain(node) if node else None
    if not isinstance(changes, list) or not changes:
        section.wrong(name, "must be a list of changes, as an adaptation has them")
        return []
    folder = section.location(name).folder
    read = [(f"{name}.{index}", change) for index, change in enumerate(changes)]
    found = []
    for place, change in read:
        try:
            meant = _meant(change)
            whole = _absolute(change, components, folder)
            found.append((place, _meant(whole), whole))
        except BadMessage as error:
            section.wrong(".".join((place, *error.where[2:])), error.why)
    known = {*components, *(meant.component for _, meant, _ in found if isinstance(meant, Add))}
    for place, meant, _ in found:
        if meant.component not in known and not isinstance(meant, EnterMode):
            section.wrong(f"{place}.component", no_such("component", meant.component, known))
    return found


def _meant(change: PlainValue) -> Change:
    """Return a change as it is read in an adaptation; raises BadMessage."""
    (found,) = codec.from_plain({"changes": [change]}, AdaptationRequest).changes
    return found


def _check_entered(section: Section, found: Mapping[str, Mapping[str, PlainChange]]) -> None:
    """Note each change that enters no mode, and the first one of each circle in which modes enter each other."""
    parts = {name: [each["mode"] for each in changes.values() if _enters(each)] for name, changes in found.items()}
    order = list(found)
    for name, changes in found.items():
        for place, change in changes.items():
            inner = change["mode"] if _enters(change) else name
            way = _way(inner, name, parts) if _enters(change) else None
            if inner not in found:
                section.wrong(f"{place}.mode", no_such("mode", inner, found))
            elif way is not None and min(map(order.index, way)) == order.index(name):
                section.wrong(f"{place}.mode", f"enters itself: {' > '.join((name, *way))}")


def _way(start: str, end: str, parts: Mapping[str, Collection[str]]) -> tuple[str, ...] | None:
    """Return the modes by which one mode enters another, both included; None if it does not."""
    ways: list[tuple[str, ...]] = [(start,)]
    seen = {start}
    while ways:
        way = ways.pop()
        if way[-1] == end:
            return way
        further = [inner for inner in parts.get(way[-1], ()) if inner not in seen]
        seen.update(further)
        ways += [(*way, inner) for inner in further]
    return None


def _unfolded(found: Mapping[str, list[PlainChange]], architecture: Architecture) -> Architecture:
    """Return the architecture with modes that have the changes of those that they enter in their places."""
    parts = {name: tuple(c["mode"] for c in changes if _enters(c)) for name, changes in found.items()}
    modes: dict[str, PlainValue] = {name: _flat(name, found) for name in found}
    return replace(architecture, modes=modes, mode_parts={name: each for name, each in parts.items() if each})


def _enters(change: PlainChange) -> bool:
    return bool(change["change"] == EnterMode.change)


def _flat(name: str, found: Mapping[str, list[PlainChange]], above: tuple[str, ...] = ()) -> list[PlainChange]:
    """Return the changes of a mode; one that is not there, or around itself, has none."""
    if name in above:
        return []
    return [
        one
        for change in found.get(name, ())
        for one in (_flat(change["mode"], found, (*above, name)) if _enters(change) else [change])
    ]


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
