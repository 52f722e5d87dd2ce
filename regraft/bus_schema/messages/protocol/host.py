"""Hosts: the processes they run, and what the adaptation manager asks of them (fenced by its term)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count, PlainValue, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.hosts.offers import NO_OFFER, HostOffer
from regraft.bus_schema.model.qualities.estimates import Figure


class ProcessState(Enum):
    """How a component's process is.

    ``waiting`` until its backoff is over, or until its host joins; ``quarantined`` until someone acts; ``lost`` with
    its host: nobody knows.
    """

    STARTING = "starting"
    RUNNING = "running"
    WAITING = "waiting"
    STOPPED = "stopped"
    QUARANTINED = "quarantined"
    LOST = "lost"


@message("regraft/ProcessStatus")
@dataclass(frozen=True, slots=True)
class ProcessStatus:
    """One component's process on a host; ``pid`` 0 while there is none, ``exit_reason`` states how the last one ended.

    ``started_as`` is the incarnation as which it was started: it has another since it took the component back.
    ``max_incarnation`` is the highest that the host knows of the component's runs, or keeps for a run elsewhere.
    """

    component: str
    incarnation: Count
    state: ProcessState
    pid: Count = 0
    restarts: Count = 0
    started: Seconds = 0.0
    exit_reason: str = ""
    managed: bool = True
    started_as: Count = 0
    max_incarnation: Count = 0


@message("regraft/OtherHost")
@dataclass(frozen=True, slots=True)
class OtherHost:
    """A host as the one sees it that it joined. ``processes`` are those of a host that cannot report them itself.

    ``offer`` is what it offered when it joined last.
    """

    host: str
    state: HostState
    processes: tuple[ProcessStatus, ...] = ()
    offer: HostOffer = NO_OFFER


@message("regraft/HostStatus")
@dataclass(frozen=True, slots=True)
class HostStatus:
    """A host and its processes: on every change, and every second.

    ``processes`` speak for their components, or would if they ran. ``beside`` are the standby runs: successors that
    wait for their turn, and incumbents that are frozen. Only the first host reports ``others``. ``term`` is the
    adaptation manager's, as the host knows it.
    """

    host: str
    stamp: Seconds
    pid: Count
    processes: tuple[ProcessStatus, ...]
    beside: tuple[ProcessStatus, ...] = ()
    others: tuple[OtherHost, ...] = ()
    term: Count = 0


@message("regraft/UpdateSpecs")
@dataclass(frozen=True, slots=True)
class UpdateSpecs:
    """From now on, (re)start these components by these specs. Running processes are not touched.

    A spec without a description keeps the one that is known of its class: it is most of a spec, and never changes.
    Those in ``removed`` are not started any more, and forgotten once they are stopped; a spec takes that back.
    ``topics`` are added to the topic table or replaced there, ``removed_topics`` are not in it any more.
    ``asked_modes`` are those that are asked for by then, None if they are as before. ``not_told`` are hosts that it
    concerns and that are not there, or did not answer: the first one has them join again.
    Those ``on_trial`` are started in an adaptation that may be undone: hosts keep the last checkpoints apart.
    ``undoes`` is the revision of an adaptation that is undone: these checkpoints are the last ones again.
    """

    revision: Count
    specs: tuple[ComponentSpec, ...] = ()
    removed: tuple[str, ...] = ()
    term: Count | None = None
    topics: tuple[TopicSpec, ...] = ()
    removed_topics: tuple[str, ...] = ()
    asked_modes: dict[str, str] | None = None
    not_told: tuple[str, ...] = ()
    on_trial: tuple[str, ...] = ()
    undoes: Count | None = None

    def applied_to(self, architecture: Architecture) -> Architecture:
        """Return the architecture as it is with this update, and at its revision."""
        known = architecture.components
        specs = {spec.name: spec.described_as(known.get(spec.name)) for spec in self.specs}
        kept = {name: spec for name, spec in known.items() if name not in self.removed}
        changed = architecture.with_topics(self.topics, self.removed_topics)
        asked = architecture.asked_modes if self.asked_modes is None else self.asked_modes
        return replace(changed, components=kept | specs, revision=self.revision, asked_modes=asked)


@message("regraft/DescribeComponent")
@dataclass(frozen=True, slots=True)
class DescribeComponent:
    """Report what a component would be that is not there yet: its class is imported, in a process of its own."""

    spec: ComponentSpec


@message("regraft/DescribedComponent")
@dataclass(frozen=True, slots=True)
class DescribedComponent:
    """A spec with its description and services, and with paths as the host takes them; and what is wrong with it."""

    spec: ComponentSpec
    violations: tuple[Violation, ...] = ()


@message("regraft/EstimateQualities")
@dataclass(frozen=True, slots=True)
class EstimateQualities:
    """Estimate the qualities of an architecture's components ``before`` and ``after`` changes, in a ``context``.

    ``measured`` is what the running components measured last, by component and quality.
    """

    before: tuple[ComponentSpec, ...]
    after: tuple[ComponentSpec, ...]
    context: dict[str, PlainValue] = field(default_factory=dict)
    measured: dict[str, dict[str, float]] = field(default_factory=dict)


@message("regraft/EstimatedQualities")
@dataclass(frozen=True, slots=True)
class EstimatedQualities:
    """The figures of both architectures, by component and quality."""

    before: dict[str, dict[str, Figure]]
    after: dict[str, dict[str, Figure]]


LEAVE_OUT = 1000
"""Incarnations left to runs on a lost host that nobody heard of: more than it can have restarted meanwhile."""


@message("regraft/StartComponent")
@dataclass(frozen=True, slots=True)
class StartComponent:
    """Start a component's process, also out of quarantine; ``incarnation`` None lets the host choose the next.

    ``resume`` gives a new component the last checkpoint of the one of its name that was removed, or ran elsewhere;
    ``afresh`` forgets the last checkpoint. ``leave_out`` numbers are left to runs that nobody may have heard of.
    """

    component: str
    incarnation: Count | None = None
    term: Count | None = None
    resume: bool = False
    leave_out: Count = 0
    afresh: bool = False


@message("regraft/StopComponent")
@dataclass(frozen=True, slots=True)
class StopComponent:
    """End a component's process and do not restart it; by force after ``grace`` seconds.

    ``started_as`` names the run, by the incarnation as which it was started, whether it speaks for the component or
    not; None means the run that speaks for it. A run next to it is forgotten then.
    """

    component: str
    grace: Annotated[Seconds, Bounds(0.0, 60.0)] = 3.0
    term: Count | None = None
    started_as: Count | None = None


@message("regraft/StartSuccessor")
@dataclass(frozen=True, slots=True)
class StartSuccessor:
    """Start a successor next to a component's run ``incumbent``, as ``spec`` states; the host chooses its incarnation.

    As long as both are there, a run that ends is not restarted at once: the sender of this decides which continues. If
    the spec is of another host than the incumbent, both are asked. The incumbent's host starts nothing, but keeps an
    incarnation for the successor: the ``max_incarnation`` of its reply. The other host gets it as ``incarnation``,
    which is 0 otherwise.
    """

    spec: ComponentSpec
    incumbent: Count
    with_state: bool = True
    term: Count | None = None
    incarnation: Count = 0


@message("regraft/LetSpeak")
@dataclass(frozen=True, slots=True)
class LetSpeak:
    """The run that was started as ``started_as`` speaks for its component.

    It is the one that is watched over and restarted, by its own spec; another run is its standby. With ``above`` it
    speaks as another incarnation, higher than that and than any that the host knows. The host chooses it. ``host`` is
    where the run is, empty for the host that is asked: another one's own run then becomes a standby.
    """

    component: str
    started_as: Count
    above: Count | None = None
    term: Count | None = None
    host: str = ""


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


@message("regraft/JournalEnd")
@dataclass(frozen=True, slots=True)
class JournalEnd:
    """How far the adaptation manager's journal has come: the first host keeps it as a witness.

    ``line`` is the highest number of an adaptation, ``revision`` the final one, ``told`` the highest one that was
    published. ``gave`` is the number of the adaptation that gave ``revision``.
    """

    line: Count = 0
    revision: Count = 0
    told: Count = 0
    gave: Count = 0
    term: Count | None = None


@message("regraft/HostView")
@dataclass(frozen=True, slots=True)
class HostView:
    """A host's assignment: the architecture as far as it knows it, the run it belongs to, and its specs in force.

    ``revision`` is the one that it got last; that of ``architecture`` stays the start's. ``journal`` is what it keeps
    as a witness.
    """

    host: str
    run: str
    term: Count
    architecture: Architecture
    specs: tuple[ComponentSpec, ...]
    revision: Count = 0
    journal: JournalEnd = JournalEnd()
