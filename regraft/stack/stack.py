"""A stack as read: its architecture, and what else the command line needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.scheduled_faults import ScheduledFault
from regraft.lockstep.source import TimeSource
from regraft.process.main import NoSuchClass, load_class
from regraft.stack.yaml.nodes import Location, Node, locations_of
from regraft.stack.yaml.problems import Problem, nearest


@dataclass(frozen=True, slots=True)
class Stack:
    """A checked stack. ``duration`` (seconds of the system's time) None runs until it is ended.

    ``file`` is the stack file as it was named. ``document`` is its content with all that it includes, and the lines.
    ``imports`` are modules to import for the message types that they define. ``references`` has the values of
    ``$world``, ``$robots`` and all else, by robot; the empty name is the stack itself. ``faults`` are on the schedule
    of the run. ``folders`` are those of all its files and robots, where its modules are looked for, in this order.
    ``files_later``: options follow, and files that are missing are no problem yet.
    """

    file: Path
    architecture: Architecture
    seed: int = 0
    duration: float | None = None
    imports: tuple[str, ...] = ()
    document: Node = field(default=Node({}), repr=False, compare=False)
    references: dict[str, dict[str, PlainValue]] = field(default_factory=dict)
    faults: tuple[ScheduledFault, ...] = ()
    folders: tuple[Path, ...] = ()
    files_later: bool = False

    @property
    def name(self) -> str:
        """The system's name."""
        return self.architecture.system

    @property
    def clock(self) -> str:
        """``real`` or ``simulated``."""
        return "simulated" if self.architecture.simulated else "real"

    @property
    def speed(self) -> str | None:
        """The pace of simulated time, ``real`` or ``max``; None under the real clock."""
        source = time_source(self)
        if source is None:
            return None
        given = self.architecture.components[source].parameters
        return str(given.get("speed", TimeSource.speed.default))

    @property
    def folder(self) -> Path:
        """The folder of the stack file, where relative paths and the stack's own modules are looked for."""
        return self.file.resolve().parent

    @property
    def locations(self) -> dict[str, Location]:
        """The file and line of each field, by dotted path."""
        return locations_of(self.document)

    def problem(self, path: str, problem: str) -> Problem:
        """Return a problem of the field at the dotted ``path``."""
        return Problem(*(nearest(self.locations, path) or Location(str(self.file))), path, problem)

    def with_field(self, keys: Sequence[str], value: Node) -> Stack:
        """Return the stack with another field in its document; the architecture stays."""
        return replace(self, document=_with_field(self.document, keys, value))


def time_sources(architecture: Architecture) -> tuple[str, ...]:
    """Return the sources of simulated time, by name; a class without description does not count.

    Such a class cannot be had, and is not imported here.
    """
    specs = sorted(architecture.components.items())
    return tuple(name for name, spec in specs if spec.description and _is_time_source(spec.cls))


def time_source(stack: Stack) -> str | None:
    """Return the stack's source of simulated time, None under the real clock."""
    return next(iter(time_sources(stack.architecture)), None)


def _is_time_source(path: str) -> bool:
    try:
        return bool(path) and issubclass(load_class(path), TimeSource)
    except NoSuchClass:
        return False


def _with_field(node: Node, keys: Sequence[str], value: Node) -> Node:
    if not keys:
        return value
    parts = node.value if isinstance(node.value, dict) else {}
    below = parts.get(keys[0], Node({}, value.location))
    return Node({**parts, keys[0]: _with_field(below, keys[1:], value)}, node.location)
