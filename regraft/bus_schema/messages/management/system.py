"""The system as it speaks of itself, for components that decide by it: the messages of the topics ``system/...``.

Each has all that is so at its time. A reader needs the latest only.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from regraft.bus_schema.annotations import Count, Seconds, Told
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import State


@message("regraft/ComponentState")
@dataclass(frozen=True, slots=True)
class ComponentState:
    """The state of one component, as which run, and why it has failed; ``state`` None: it has no run now."""

    component: str
    incarnation: Count
    state: State | None
    failure: str = ""


@message("regraft/SystemStates")
@dataclass(frozen=True, slots=True)
class SystemStates:
    """The states of all components, by name. Under simulated time these are the members of the clock."""

    stamp: Seconds
    components: tuple[ComponentState, ...] = ()

    def state_of(self, component: str) -> State | None:
        """Return the state of a component, None if it has no run or is not known."""
        return next((known.state for known in self.components if known.component == component), None)


class SystemFaultKind(Enum):
    """The kind of a fault: a component leaves its state by itself, a handler raises, a process ends.

    A process may end because its loop hung, or too often. ``recovered`` is the end of a fault.
    """

    FAILED = "failed"
    RAISED = "raised"
    DIED = "died"
    HUNG = "hung"
    QUARANTINED = "quarantined"
    RECOVERED = "recovered"


@message("regraft/SystemFault")
@dataclass(frozen=True, slots=True)
class SystemFault:
    """A fault of a run of a component, or its end; ``code`` is how it failed or recovered, for programs."""

    stamp: Seconds
    component: str
    incarnation: Count
    kind: SystemFaultKind
    text: Told = ""
    code: str = ""


@message("regraft/SystemFaults")
@dataclass(frozen=True, slots=True)
class SystemFaults:
    """The faults that are not over (``present``), and what has happened since the message before (``news``)."""

    stamp: Seconds
    present: tuple[SystemFault, ...] = ()
    news: tuple[SystemFault, ...] = ()


@message("regraft/SystemDiagnostics")
@dataclass(frozen=True, slots=True)
class SystemDiagnostics:
    """The latest diagnostic of each subject, and those that are new."""

    stamp: Seconds
    present: tuple[Diagnostic, ...] = ()
    news: tuple[Diagnostic, ...] = ()


@message("regraft/SystemQualities")
@dataclass(frozen=True, slots=True)
class SystemQualities:
    """How each quality requirement is met, by its name."""

    stamp: Seconds
    qualities: tuple[Quality, ...] = ()


@message("regraft/SystemMeasurements")
@dataclass(frozen=True, slots=True)
class SystemMeasurements:
    """The qualities that active components have measured last, by the component's name.

    A component is left out until it has measured, and from the end of its activity on.
    """

    stamp: Seconds
    components: tuple[MeasuredQualities, ...] = ()

    def of(self, component: str) -> MeasuredQualities | None:
        """Return what a component has measured last, None if there is nothing that counts."""
        return next((each for each in self.components if each.component == component), None)


@message("regraft/HostCondition")
@dataclass(frozen=True, slots=True)
class HostCondition:
    """A host, as the first host sees it."""

    host: str
    state: HostState


@message("regraft/SystemHosts")
@dataclass(frozen=True, slots=True)
class SystemHosts:
    """All hosts but the first, which is always there."""

    stamp: Seconds
    hosts: tuple[HostCondition, ...] = ()


@message("regraft/SystemNews")
@dataclass(frozen=True, slots=True)
class SystemNews:
    """A member's news of itself since its last acknowledgement; ``state`` if it is another."""

    state: ComponentState | None = None
    faults: tuple[SystemFault, ...] = ()
    diagnostics: tuple[Diagnostic, ...] = ()
    qualities: tuple[Quality, ...] = ()
    measured: MeasuredQualities | None = None
