"""A stack as read: its architecture, and what the command line needs beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from regraft.bus_schema.model.architecture import Architecture
from regraft.lockstep.source import TimeSource
from regraft.process.main import NoSuchClass, load_class


@dataclass(frozen=True, slots=True)
class Stack:
    """A checked stack. ``duration`` (seconds of the system's time) None runs until it is ended.

    ``file`` is the stack file as it was named; ``lines`` has the line of each of its fields by dotted path.
    ``imports`` are modules to import for the message types that they define.
    """

    file: Path
    architecture: Architecture
    seed: int = 0
    duration: float | None = None
    imports: tuple[str, ...] = ()
    lines: dict[str, int] = field(default_factory=dict, repr=False, compare=False)

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


def time_sources(architecture: Architecture) -> tuple[str, ...]:
    """Return the components that make simulated time go on, by name; a class without description is none.

    Such a class cannot be had, and is not imported here.
    """
    specs = sorted(architecture.components.items())
    return tuple(name for name, spec in specs if spec.description and _is_time_source(spec.cls))


def time_source(stack: Stack) -> str | None:
    """Return the component that makes the stack's simulated time go on, None under the real clock."""
    return next(iter(time_sources(stack.architecture)), None)


def _is_time_source(path: str) -> bool:
    try:
        return bool(path) and issubclass(load_class(path), TimeSource)
    except NoSuchClass:
        return False
