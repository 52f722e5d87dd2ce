"""Reads the modes of a stack file: named sets of changes, each done as one adaptation."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationRequest, Add, Change, EnterMode
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.consistency import contradictions
from regraft.bus_schema.model.modes.mode_parts import way_between
from regraft.bus_schema.model.modes.mode_sizes import size_problems
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.bus_schema.suggestions import Hints
from regraft.stack.relative_paths import with_run_folder
from regraft.stack.sections.mode_changes import Surroundings, change_problems, description_for, targets_of
from regraft.stack.sections.mode_files import MODES, PlainChange, modes_of_files, with_absolute_values
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.section import Section


@dataclass(frozen=True, slots=True)
class ReadModes:
    """An architecture with its modes; ``names_known`` is whether the names of all modes are.

    ``rule_locations`` are the places of rules that files of system_modes have, by name.
    """

    architecture: Architecture
    names_known: bool
    rule_locations: Mapping[str, Location] = field(default_factory=dict)


def with_modes(root: Section, architecture: Architecture, around: Surroundings) -> ReadModes:
    """Return the architecture with the modes of ``modes``.

    The modes speak of its components. One that is wrong is noted, and has the changes that are right. ``modes`` may
    name files of ROS 2's system_modes, whose modes those of the stack may enter. The stack ``around`` them
    decides how classes are described that modes give to components.
    """
    given = root.node(MODES)
    of_files = modes_of_files(root, architecture.components)
    section = Section(_inline(given), MODES, root.report)
    read = {name: _changes(section, name, architecture.components, around) for name in section.names()}
    for name in read.keys() & of_files.modes.keys():
        section.wrong(name, "a file of system_modes has a mode of this name, too: give this one another name")
    targets = targets_of(architecture, (meant for changes in read.values() for _, meant, _ in changes), around)
    for changes in read.values():
        for place, meant, _ in changes:
            for below, problem in change_problems(meant, targets):
                section.wrong(f"{place}.{below}", problem)
    for changes in read.values():
        for twice in contradictions([meant for _, meant, _ in changes]):
            section.wrong(f"{changes[twice.change or 0][0]}.{twice.field}", twice.problem)
    found = {name: {place: whole for place, _, whole in changes} for name, changes in read.items()}
    large = _too_large(section, found, of_files.modes)
    if of_files.complete:
        in_circles = _check_entered(section, found, of_files.modes, large)
        large |= in_circles
    known = given is None or given.value is None or isinstance(given.value, dict | str)
    whole = {name: list(changes.values()) for name, changes in found.items() if name not in large}
    architecture = _unfolded(of_files.modes | whole, architecture)
    parts = of_files.parts | architecture.mode_parts
    architecture = replace(architecture, mode_parts=parts, mode_rules=of_files.rules)
    return ReadModes(architecture, known and of_files.complete, of_files.rule_locations)


def _inline(given: Node | None) -> Node:
    """Return the modes that are written in the stack itself."""
    if given is None or isinstance(given.value, str):
        return Node({})
    if not isinstance(given.value, dict):
        return given
    return Node({name: node for name, node in given.value.items() if not name.endswith(SHARED)}, given.location)


def _changes(
    section: Section, name: str, components: Mapping[str, ComponentSpec], around: Surroundings
) -> list[tuple[str, Change, PlainChange]]:
    """Return the changes of a mode that can be read: the field of each, its meaning, and it with absolute paths."""
    node = section.node(name)
    if node is None or not isinstance(node.value, tuple) or not node.value:
        section.wrong(name, "must be a list of changes, as an adaptation has them")
        return []
    found = []
    for index, given in enumerate(node.value):
        place, change = f"{name}.{index}", plain(given)
        try:
            meant = _meant(change)
            folders = _folders(given)
            description = description_for(meant, components.get(meant.component), around, folders)
            whole = with_absolute_values(change, description, folders)
            found.append((place, _meant(whole), whole))
        except BadMessage as error:
            section.wrong(".".join((place, *error.where[2:])), error.why)
    known = {*components, *(meant.component for _, meant, _ in found if isinstance(meant, Add))}
    hints = Hints(known)
    for place, meant, _ in found:
        if meant.component not in known and not isinstance(meant, EnterMode):
            section.wrong(f"{place}.component", hints.no_such("component", meant.component))
    return found


def _folders(change: Node) -> dict[str, Path]:
    """Return the folders from which the paths among a change's parameters are looked for: those of their files."""
    fields = change.value if isinstance(change.value, dict) else {}
    above = fields["spec"].value if "spec" in fields else fields
    given = above["parameters"].value if isinstance(above, dict) and "parameters" in above else {}
    return {name: node.location.folder for name, node in given.items()} if isinstance(given, dict) else {}


def _meant(change: PlainValue) -> Change:
    """Return a change as it is read in an adaptation; raises BadMessage."""
    (found,) = codec.from_plain({"changes": [change]}, AdaptationRequest).changes
    return found


def _check_entered(
    section: Section,
    found: Mapping[str, Mapping[str, PlainChange]],
    of_files: Collection[str],
    large: Collection[str],
) -> set[str]:
    """Note each change that enters no mode, and the first one of each circle in which modes enter each other.

    No circle is looked for where modes are too ``large``. Returns the modes of circles.
    """
    in_circles: set[str] = set()
    parts = {name: [each["mode"] for each in changes.values() if _enters(each)] for name, changes in found.items()}
    order = {name: index for index, name in enumerate(found)}
    hints = Hints((*of_files, *found))
    for name, changes in found.items():
        for place, change in changes.items():
            inner = change["mode"] if _enters(change) else name
            way = way_between(inner, name, parts) if _enters(change) and name not in large else None
            if inner not in found and inner not in of_files:
                section.wrong(f"{place}.mode", hints.no_such("mode", inner))
            if way is not None:
                in_circles.update(way)
            if way is not None and inner in {*found, *of_files} and min(order[each] for each in way) == order[name]:
                section.wrong(f"{place}.mode", f"enters itself: {' > '.join((name, *way))}")
    return in_circles


def _too_large(
    section: Section, found: Mapping[str, Mapping[str, PlainChange]], of_files: Mapping[str, Collection[PlainChange]]
) -> set[str]:
    """Note each mode that is too large with those that it enters; returns them."""
    both = {name: list(changes.values()) for name, changes in found.items()}
    own = {name: sum(not _enters(change) for change in changes) for name, changes in both.items()}
    entered = {name: [change["mode"] for change in changes if _enters(change)] for name, changes in both.items()}
    problems = dict(size_problems({name: len(changes) for name, changes in of_files.items()} | own, entered))
    for name in found.keys() & problems.keys():
        section.wrong(name, problems[name])
    return set(problems)


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


def modes_in_run_folder(modes: Mapping[str, PlainValue], folder: str) -> dict[str, PlainValue]:
    """Return modes with the parameters that begin with ``$RUN`` in the folder of the running system."""
    return {name: [_in_run_folder(change, folder) for change in changes] for name, changes in modes.items()}


def _in_run_folder(change: PlainChange, folder: str) -> PlainChange:
    given = change.get("parameters")
    return {**change, "parameters": with_run_folder(given, folder)} if given else change
