"""Views beyond the messages of the bus: overviews put together from architecture and status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Count, Hertz, Named, PlainValue, Seconds
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.management.system import SystemFault
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.messages.protocol.host import HostStatus, ProcessStatus
from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import State
from regraft.client.capability import HostCapability
from regraft.client.qualities import QualityNow


@dataclass(frozen=True, slots=True)
class SystemOverview:
    """The system in one answer. ``components`` counts them by state; ``problems`` describes in words what is wrong.

    ``revision`` and ``simulated`` are null while the adaptation manager is silent, ``clock`` under the real clock.
    """

    system: str
    revision: Count | None
    simulated: bool | None
    clock: ClockTime | None
    components: dict[str, Count]
    hosts: tuple[str, ...]
    problems: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ComponentLine:
    """A component in the overview: as it should be (``desired``), and as it is.

    ``age`` is the seconds since its last heartbeat. ``failure`` is why it failed by itself.
    It is empty once the component has recovered. An unknown value is null.
    """

    name: str
    cls: Annotated[str | None, Named("class")]
    host: str | None
    desired: State | None
    state: State | None
    alive: bool
    incarnation: Count | None
    age: Seconds | None
    pid: Count | None
    restarts: Count | None
    error: str
    failure: str
    detail: str
    values: dict[str, PlainValue]


@dataclass(frozen=True, slots=True)
class ComponentList:
    """All components, and the revision of the architecture; null while the adaptation manager is silent."""

    revision: Count | None
    components: tuple[ComponentLine, ...]


@dataclass(frozen=True, slots=True)
class ComponentDetails:
    """All that is known of a component: ``spec`` as it should be, ``now`` as it answers itself, null if it does not."""

    name: str
    alive: bool
    age: Seconds | None
    spec: ComponentSpec | None
    status: ComponentStatus | None
    process: ProcessStatus | None
    now: ComponentView | None


@dataclass(frozen=True, slots=True)
class TopicLine:
    """A topic, and the ports connected to it as ``component.port``."""

    name: str
    type: str
    reliable: bool
    rate: Hertz | None
    writers: tuple[str, ...]
    readers: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TopicList:
    """All topics of a revision."""

    revision: Count
    topics: tuple[TopicLine, ...]


@dataclass(frozen=True, slots=True)
class QualityList:
    """All qualities that components measure."""

    qualities: tuple[QualityNow, ...]


@dataclass(frozen=True, slots=True)
class HostLine:
    """A host and its processes; ``age`` is the seconds since it last spoke.

    ``state`` is how the first host sees it, null for the first host itself. ``capability`` is null while the adaptation
    manager is silent.
    """

    name: str
    alive: bool
    age: Seconds | None
    status: HostStatus | None
    state: HostState | None = None
    processes: tuple[ProcessStatus, ...] = ()
    capability: HostCapability | None = None


@dataclass(frozen=True, slots=True)
class HostList:
    """All hosts."""

    hosts: tuple[HostLine, ...]


@dataclass(frozen=True, slots=True)
class JournalView:
    """Lines of the journal, newest first; ``next`` is the cursor (``before``) of the next page, null on the last.

    ``faults`` are the failures and recoveries of components in the time of these lines, newest first. ``waiting``, on
    the first page alone, are adaptations without a line yet: they wait for their turn, or are being checked.
    """

    entries: tuple[AdaptationReport, ...]
    next: str | None
    faults: tuple[SystemFault, ...] = ()
    waiting: tuple[AdaptationReport, ...] = ()
