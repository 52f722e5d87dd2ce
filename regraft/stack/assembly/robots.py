"""The robots of a stack: their files, and what the stack makes of them for each use."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from regraft.bus_schema import keys
from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.assembly.included_files import IncludedFiles
from regraft.stack.assembly.merge import merge
from regraft.stack.installed import installed_robot, instead_of_robot
from regraft.stack.yaml.nodes import Location, Node
from regraft.stack.yaml.problems import Report, StackError

ROBOT, ROBOTS = "robot", "robots"
ROBOT_FILE = "robot.yaml"
PLACES = ("place", "region")
"""Where a robot stands, or where its place is drawn: fields of the use of a robot."""
PASSED_ON = ("base", "radius")
"""Fields of a robot that only worlds know."""
FIELDS = ("model", *PASSED_ON, "parameters", "devices", "topics", "components", "constraints", "modes", "rules")
SINGLE = ""
"""The name of the robot whose names stay short."""


@dataclass(frozen=True, slots=True)
class Use:
    """A robot as a stack uses it. ``fields`` are those of its file with what the stack changes, and its ``place``.

    ``location`` is where the stack names it, ``whole`` where its file begins.
    """

    name: str
    location: Location
    whole: Location
    fields: dict[str, Node]

    @property
    def path(self) -> str:
        """The dotted path of the use in the stack file."""
        return f"{ROBOTS}.{self.name}" if self.name else ROBOT


@dataclass(slots=True)
class Robots:
    """The robots that the files of a stack name, as far as these are read."""

    files: IncludedFiles
    report: Report
    _uses: dict[str, Use] = field(default_factory=dict)

    def __iter__(self) -> Iterator[Use]:
        """Yield the uses, the single robot first."""
        yield from sorted(self._uses.values(), key=lambda use: use.name != SINGLE)

    def apply(self, fields: dict[str, Node]) -> None:
        """Take ``robot`` and ``robots`` out of a stack file's fields, and apply them over earlier ones."""
        single, several = fields.pop(ROBOT, None), fields.pop(ROBOTS, None)
        if single is not None:
            self._apply(SINGLE, ROBOT, single)
        if several is None:
            return
        if several.value is None:
            self._uses = {name: use for name, use in self._uses.items() if name == SINGLE}
            return
        if not isinstance(several.value, dict):
            self.report.add_at(several.location, ROBOTS, f"must be a map of robots by name, is {several.kind}")
            return
        for name, entry in several.value.items():
            self._apply(name, f"{ROBOTS}.{name}", entry)

    def _apply(self, name: str, path: str, entry: Node) -> None:
        if isinstance(entry.value, str):
            entry = Node({ROBOT: entry}, entry.location)
        if entry.value is None:
            if self._uses.pop(name, None) is None:
                self.report.add_at(entry.location, path, f"there is no such robot to remove; {self._instead_of(name)}")
        elif not isinstance(entry.value, dict):
            problem = f"must be a map, or the folder or file of a robot, is {entry.kind}"
            self.report.add_at(entry.location, path, problem)
        elif ROBOT in entry.value or name in self._uses:
            self._change(name, path, entry.location, dict(entry.value))
        else:
            problem = f"there is no such robot to change, and a new one needs '{ROBOT}'; {self._instead_of(name)}"
            self.report.add_at(entry.location, path, problem)

    def _change(self, name: str, path: str, location: Location, changes: dict[str, Node]) -> None:
        robot, before = changes.pop(ROBOT, None), self._uses.get(name)
        use = before if robot is None else self._new(name, path, location, robot, before)
        if use is None:
            return
        for key in [key for key in changes if key not in (*FIELDS, *PLACES)]:
            hint = instead_of(key, (ROBOT, *PLACES, *FIELDS))
            self.report.add_at(changes.pop(key).location, f"{path}.{key}", f"there is no such field; {hint}")
        merged = merge(Node(use.fields), Node(changes), self.report, path, fixed=("parameters",))
        assert isinstance(merged.value, dict)
        self._uses[name] = Use(name, use.location, use.whole, merged.value)

    def _new(self, name: str, path: str, location: Location, robot: Node, before: Use | None) -> Use | None:
        """Return a robot as its file has it, at the place of the one before."""
        try:
            if path != ROBOT:
                keys.robot_name(name)
            instead = instead_of_robot(Path(str(robot.value)))
            file = self.files.target(_located(robot), f"{path}.{ROBOT}", ROBOT_FILE, instead)
            patches = self.files.patches(file, FIELDS) if file else []
        except BadKey as error:
            self.report.add_at(location, path, str(error))
            return None
        except StackError as error:
            self.report.problems += error.problems
            return None
        if file is None:
            return None
        document = patches[0]
        for patch in patches[1:]:
            document = merge(document, patch, self.report)
        assert isinstance(document.value, dict)
        # Without a model the robot stands in the world's file, at a place of its own.
        places = PLACES if before and "model" in document.value else ()
        placed = {key: before.fields[key] for key in places if before and key in before.fields}
        return Use(name, location, Location(str(file), 1), document.value | placed)

    def _instead_of(self, name: str) -> str:
        return instead_of(name, filter(None, self._uses))


def _located(robot: Node) -> Node:
    """Return a robot's folder or file: one next to the stack goes before an installed robot of the name."""
    name = robot.value
    if not isinstance(name, str) or "/" in name or _exists(robot.location.folder / name):
        return robot
    folder = installed_robot(name)
    return robot if folder is None else Node(str(folder.absolute()), robot.location)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # no file can have such a name
        return False
