"""How components and the system are: status, diagnostics, events."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from regraft.bus_schema.annotations import Count, PlainValue, Ratio, Seconds, Told
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.lifecycle import State


@message("regraft/ComponentStatus")
@dataclass(frozen=True, slots=True)
class ComponentStatus:
    """State of one run of a component: on every change, and as a heartbeat from the component's own loop.

    ``revision`` is the architecture revision that it received last; ``error`` its last error, empty if none;
    ``lost`` and ``refused`` count messages missing from, and refused on, its inputs. ``detail`` is what it does, for
    people; ``values`` is the same for programs, such as the ``url`` of a gateway or the ``renderer`` of a camera.
    ``failure`` is why it left its state by itself, empty unless it has failed and not recovered.
    """

    component: str
    incarnation: Count
    state: State
    revision: Count
    stamp: Seconds
    error: str = ""
    lost: Count = 0
    refused: Count = 0
    detail: str = ""
    values: dict[str, PlainValue] = field(default_factory=dict)
    failure: str = ""


class Level(Enum):
    """How bad a diagnostic is."""

    OK = "ok"
    WARNING = "warning"
    ERROR = "error"
    STALE = "stale"


@message("regraft/Diagnostic")
@dataclass(frozen=True, slots=True)
class Diagnostic:
    """A component's diagnosis of one part of itself or of its surroundings."""

    stamp: Seconds
    source: str
    subject: str
    level: Level
    text: Told
    values: dict[str, PlainValue] = field(default_factory=dict)


@message("regraft/Event")
@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened once: an adaptation, a fault, a transition, a restart.

    ``kind`` is dotted, such as ``component.restarted``; ``subject`` names who it happened to.
    """

    stamp: Seconds
    kind: str
    subject: str
    text: Told
    details: dict[str, PlainValue] = field(default_factory=dict)


@message("regraft/SensorFault")
@dataclass(frozen=True, slots=True)
class SensorFault:
    """A fault of the messages on ``topic``, in a word (such as ``silent``) and in a sentence, and since when."""

    topic: str
    fault: str
    text: str
    since: Seconds


@message("regraft/SensorHealth")
@dataclass(frozen=True, slots=True)
class SensorHealth:
    """The topics of sensors that are watched, and what is wrong with them now; no faults, no trouble."""

    stamp: Seconds
    watched: tuple[str, ...]
    faults: tuple[SensorFault, ...] = ()


@message("regraft/SystemStatus")
@dataclass(frozen=True, slots=True)
class SystemStatus:
    """The system in one line: how many components in which state, battery, light, and what is wrong."""

    stamp: Seconds
    components: dict[str, Count]
    charge: Ratio | None = None
    darkness: Ratio | None = None
    problems: tuple[str, ...] = ()
