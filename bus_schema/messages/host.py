"""Hosts: the processes they run, and what the adaptation manager asks of them (fenced by its term)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from bus_schema.annotations import Bounds, Count, Seconds
from bus_schema.architecture import Architecture, ComponentSpec
from bus_schema.registry import message


class ProcessState(Enum):
    """How a component's process is: ``waiting`` until its backoff is over, ``quarantined`` until someone acts."""

    STARTING = "starting"
    RUNNING = "running"
    WAITING = "waiting"
    STOPPED = "stopped"
    QUARANTINED = "quarantined"


@message("regraft/ProcessStatus")
@dataclass(frozen=True, slots=True)
class ProcessStatus:
    """One component's process on a host; ``pid`` 0 while there is none, ``last_end`` says how the last one ended."""

    component: str
    incarnation: Count
    state: ProcessState
    pid: Count = 0
    restarts: Count = 0
    started: Seconds = 0.0
    last_end: str = ""
    managed: bool = True


@message("regraft/HostStatus")
@dataclass(frozen=True, slots=True)
class HostStatus:
    """A host and its processes: on every change, and every second."""

    host: str
    stamp: Seconds
    pid: Count
    processes: tuple[ProcessStatus, ...]


@message("regraft/UpdateSpecs")
@dataclass(frozen=True, slots=True)
class UpdateSpecs:
    """From now on, (re)start these components as these specs say. Running processes are not touched.

    A spec without a description keeps the one that is known of its class: it is most of a spec, and never changes.
    """

    revision: Count
    specs: tuple[ComponentSpec, ...] = ()
    removed: tuple[str, ...] = ()
    term: Count | None = None


@message("regraft/StartComponent")
@dataclass(frozen=True, slots=True)
class StartComponent:
    """Start a component's process, also out of quarantine; ``incarnation`` None lets the host choose the next."""

    component: str
    incarnation: Count | None = None
    term: Count | None = None


@message("regraft/StopComponent")
@dataclass(frozen=True, slots=True)
class StopComponent:
    """End a component's process and do not restart it; by force after ``grace`` seconds."""

    component: str
    grace: Annotated[Seconds, Bounds(0.0, 60.0)] = 3.0
    term: Count | None = None


@message("regraft/LogRequest")
@dataclass(frozen=True, slots=True)
class LogRequest:
    """The last lines of a component's log."""

    component: str
    lines: Annotated[int, Bounds(1, 10_000)] = 100


@message("regraft/LogLines")
@dataclass(frozen=True, slots=True)
class LogLines:
    """Lines of a log, oldest first."""

    component: str
    lines: tuple[str, ...]


@message("regraft/HostView")
@dataclass(frozen=True, slots=True)
class HostView:
    """What a host was given: the architecture at the stack's start, the run it belongs to, and the specs in force."""

    host: str
    run: str
    term: Count
    architecture: Architecture
    specs: tuple[ComponentSpec, ...]
