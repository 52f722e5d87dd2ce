"""The assignment of a process: which component to be, and its spec in the architecture."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus_schema.annotations import ClassPath, Connections, Count, PlainValue, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.scheduled_faults import ScheduledFault


@message("regraft/Succession")
@dataclass(frozen=True, slots=True)
class Succession:
    """Whom a run succeeds: a living incarnation of the same component, with its state or, if so wanted, without."""

    incarnation: Count
    with_state: bool = True


@message("regraft/Assignment")
@dataclass(frozen=True, slots=True)
class Assignment:
    """One run of one component.

    ``term`` None means unfenced: a component run alone takes control queries from anybody. ``sensor_streams`` lists the
    topics that drop rather than block. ``members`` (time sources only) are the components to wait for. A run that
    ``succeeds`` another waits, silently, until it is asked to take over. ``secret`` proves to the hub that it belongs
    to the system. ``step_socket`` is where the source of time exchanges steps with members on its machine (a path;
    empty: over the bus). ``lease`` is the path of a file with the time until which it may act; empty: always.
    ``handler_timeout`` takes the place of what its class states. ``scope`` is the robot among several whose names the
    component's names are (`regraft.bus_schema.model.robots.scopes`); empty for none. ``faults`` are the component's own
    on the schedule of the run, for time sources all of them. Of those that hang or stop, none is silent for longer than
    ``hung_after`` before its host ends it.
    """

    system: str
    name: str
    cls: ClassPath
    incarnation: Count = 1
    parameters: dict[str, PlainValue] = field(default_factory=dict)
    connections: Connections = field(default_factory=dict)
    services: dict[str, str] = field(default_factory=dict)
    state: State = State.ACTIVE
    revision: Count = 0
    term: Count | None = None
    simulated: bool = False
    seed: Count = 0
    heartbeat: Seconds = 0.15
    sensor_streams: tuple[str, ...] = ()
    checkpoint: Snapshot | None = None
    listen_endpoints: tuple[str, ...] = ()
    connect_endpoints: tuple[str, ...] = ()
    step_socket: str = ""
    members: tuple[str, ...] = ()
    speed: str = "real"
    duration: Seconds | None = None
    succeeds: Succession | None = None
    secret: str = field(default="", repr=False)
    lease: str = ""
    handler_timeout: Seconds | None = None
    scope: str = ""
    faults: tuple[ScheduledFault, ...] = ()
    hung_after: Seconds = 0.0
