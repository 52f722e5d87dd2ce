"""Makes one document of a stack's files: includes are merged, robots expanded, references replaced."""

from __future__ import annotations

from dataclasses import dataclass
from keyword import iskeyword
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.stack.assembly.expansion import Robot, RobotData, robot_of
from regraft.stack.assembly.included_files import INCLUDE, IncludedFiles
from regraft.stack.assembly.merge import long_form, merge
from regraft.stack.assembly.references import WORLD, References
from regraft.stack.assembly.robots import ROBOT, ROBOTS, Robots, Use
from regraft.stack.assembly.scoping import Entry, names_own_in_expressions, scoped_constraints, scoped_entries
from regraft.stack.sections.mode_files import MODES
from regraft.stack.yaml.document import MAX_NODES
from regraft.stack.yaml.nodes import NOWHERE, Node, locations_of, plain, size_of
from regraft.stack.yaml.problems import Report, fail

ASSEMBLED = (INCLUDE, WORLD, ROBOT, ROBOTS)
"""The fields of a stack file that the assembled document has no more."""


@dataclass(frozen=True, slots=True)
class Assembly:
    """A stack's document, a report that knows the lines of its fields, and the folders of its files.

    ``robots`` are the parameters of each robot by its name, which is empty for the single one. ``references`` has the
    values of ``$world``, ``$robots``, ``$robot`` and all else, by robot; the empty name is the stack itself.
    """

    document: Node
    report: Report
    folders: tuple[Path, ...]
    references: dict[str, dict[str, PlainValue]]
    robots: dict[str, RobotData]


def assemble(file: Path) -> Assembly:
    """Return a stack file with all the files that it names, as one.

    Raises:
        StackError: with everything that is wrong so far, each with file, line and field.
    """
    report = Report(str(file))
    files = IncludedFiles(report)
    robots = Robots(files, report)
    document = _merged(files.patches(file), robots, report)
    fields, known, found = _expanded(document, robots, files, report)
    report.raise_if_any()
    document = Node(fields, document.location)
    if size_of(document) > MAX_NODES:
        fail(str(file), None, f"holds more than {MAX_NODES} values with all its robots")
    report.locations = locations_of(document)
    data = {robot.use.name: robot.data for robot in found}
    return Assembly(document, report, tuple(files.folders), _values(known, data), data)


def _values(known: dict[str, Node], data: dict[str, RobotData]) -> dict[str, dict[str, PlainValue]]:
    shared = {name: plain(node) for name, node in known.items()}
    own = {
        robot: {name: plain(node) for name, node in of.parameters.items()} | {ROBOT: robot}
        for robot, of in data.items()
    }
    return {robot: own.get(robot, {}) | shared for robot in ("", *own)}


def _merged(patches: list[Node], robots: Robots, report: Report) -> Node:
    """Return the files of a stack, each over those before it, without their robots, which ``robots`` collect."""
    document: Node | None = None
    for patch in patches:
        assert isinstance(patch.value, dict)
        fields = dict(patch.value)
        robots.apply(fields)
        patch = Node(fields, patch.location)
        document = patch if document is None else merge(document, patch, report)
    assert document is not None
    # The stack file is the last of the files: fields without a line of their own get its first.
    return Node(document.value, patches[-1].location)


def _expanded(
    document: Node, robots: Robots, files: IncludedFiles, report: Report
) -> tuple[dict[str, Node], dict[str, Node], list[Robot]]:
    """Return the fields of a stack with those of its robots, the values of references, and the robots."""
    assert isinstance(document.value, dict)
    fields = dict(document.value)
    known: dict[str, Node] = {}
    world = fields.pop(WORLD, None)
    if world is not None:
        path = files.target(world, WORLD)
        known[WORLD] = Node(str(path.absolute()) if path else "", world.location)
    found = [robot_of(use, known, report) for use in robots]
    known[ROBOTS] = Node(tuple(robot.for_worlds(files) for robot in found), NOWHERE)
    single = {name: node for robot in found if not robot.use.name for name, node in robot.data.parameters.items()}
    references = References(report, single | known)
    fields = {key: references.resolved(node, key) for key, node in fields.items()}
    return _Combination(fields, report).with_robots(found, known[ROBOTS]), known, found


class _Combination:
    """The fields of a stack with those of its robots."""

    def __init__(self, fields: dict[str, Node], report: Report) -> None:
        self._fields = fields
        self._report = report

    def with_robots(self, robots: list[Robot], listed: Node) -> dict[str, Node]:
        """Return the fields; names that are given twice are noted."""
        for robot in robots:
            robot.references.known[ROBOTS] = listed
            fields = self._speakable(robot.use, robot.for_stack())
            for entry in scoped_entries(robot.use.name, fields):
                self._enter(robot, entry)
            self._append(robot, scoped_constraints(robot.use.name, fields))
        for robot in robots:
            component = self._entries("components").get(robot.use.name)
            if component is not None:
                problem = f"a component has this name too, at {component.location}: name the robot otherwise"
                self._report.add_at(robot.use.location, robot.use.path, problem)
        return self._fields

    def _speakable(self, use: Use, fields: dict[str, Node]) -> dict[str, Node]:
        """Return a robot's fields, without expressions if the robot's name, which is noted, has no place in them."""
        is_word = use.name.isidentifier() and not iskeyword(use.name)
        if not use.name or is_word or not names_own_in_expressions(fields):
            return fields
        problem = f"{use.name!r} has no place in expressions, and {use.whole.file} has some"
        must = "must be letters, digits and '_', without a digit first, and no word of Python's"
        self._report.add_at(use.location, use.path, f"{problem}: {must}")
        return {key: node for key, node in fields.items() if key not in ("constraints", "rules")}

    def _entries(self, section: str) -> dict[str, Node]:
        node = self._fields.get(section)
        return node.value if node is not None and isinstance(node.value, dict) else {}

    def _enter(self, robot: Robot, entry: Entry) -> None:
        node = self._fields.get(entry.section)
        if entry.section == MODES and node is not None and isinstance(node.value, str):
            self._fields[MODES] = Node({SHARED: node}, node.location)
        entries = self._entries(entry.section)
        there = entries.get(entry.name)
        if there is not None and entry.written.startswith(SHARED) and _same(there, entry):
            return
        if there is not None:
            path = f"{robot.use.path}.{entry.section}.{entry.written}"
            self._report.add_at(there.location, f"{entry.section}.{entry.name}", self._taken(robot, entry, path))
            return
        node = self._fields.get(entry.section)
        if node is None or isinstance(node.value, dict) or node.value is None:
            location = node.location if node else robot.use.whole
            self._fields[entry.section] = Node({**entries, entry.name: entry.node}, location)
        else:
            self._report.add_at(node.location, entry.section, f"must be a map beside robots, is {node.kind}")

    @staticmethod
    def _taken(robot: Robot, entry: Entry, path: str) -> str:
        who = f"robot {robot.use.name!r}" if robot.use.name else "the robot"
        return f"{who} has this name too, at {entry.node.location}: the robot's own is changed under '{path}'"

    def _append(self, robot: Robot, constraints: tuple[Node, ...]) -> None:
        node = self._fields.get("constraints")
        if not constraints:
            return
        if node is None or isinstance(node.value, tuple):
            before = node.value if node is not None and isinstance(node.value, tuple) else ()
            location = node.location if node else robot.use.whole
            self._fields["constraints"] = Node((*before, *constraints), location)


def _same(there: Node, entry: Entry) -> bool:
    """Return whether an entry is there as it is already; a topic may be given by its type alone."""
    both = (long_form(node, "type") if entry.section == "topics" else node for node in (there, entry.node))
    one, other = map(plain, both)
    return bool(one == other)


def plain_document(file: Path) -> dict[str, PlainValue]:
    """Return a stack file with all the files that it names, as plain data; raises StackError."""
    found: dict[str, PlainValue] = plain(assemble(file).document)
    return found
