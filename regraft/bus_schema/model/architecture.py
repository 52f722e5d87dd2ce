"""The architecture: what should be. Changed only by adaptations, each giving a new revision."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, ClassPath, Connections, Count, Hertz, PlainValue, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.description import Amounts, Description, PortDescription
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.mode_rules import ModeRule


class Writers(Enum):
    """How many components may write a topic."""

    ONE = "one"
    MANY = "many"


class Restart(Enum):
    """When a component's process is started again."""

    ALWAYS = "always"
    ON_FAILURE = "on_failure"
    NEVER = "never"


@message("regraft/TopicSpec")
@dataclass(frozen=True, slots=True)
class TopicSpec:
    """A topic: its type, its nominal rate (None if it is written when something happens), and how it is carried.

    A reliable topic blocks its writer, within bounds, and reports holes; a sensor stream drops instead.
    """

    name: str
    type: str
    reliable: bool = True
    rate: Hertz | None = None
    writers: Writers = Writers.ONE


@message("regraft/RestartPolicy")
@dataclass(frozen=True, slots=True)
class RestartPolicy:
    """Restart when, at most ``limit`` times in ``window`` seconds (then quarantined), after a doubling ``backoff``."""

    when: Restart = Restart.ALWAYS
    limit: Annotated[int, Bounds(0, 1000)] = 5
    window: Annotated[Seconds, Bounds(0.1, 86_400.0)] = 30.0
    backoff: Annotated[Seconds, Bounds(0.0, 60.0)] = 0.05


@message("regraft/Limits")
@dataclass(frozen=True, slots=True)
class Limits:
    """The most that a component may use; None: no limit.

    ``memory`` (MiB) is what its processes may have together. ``files`` are those that each of them may have open.
    ``handler_timeout`` (seconds) is how long a handler or hook may keep its loop; None: as long as its class states.
    """

    memory: Annotated[float, Bounds(16.0)] | None = None
    files: Annotated[int, Bounds(32, 1_000_000)] | None = None
    handler_timeout: Annotated[Seconds, Bounds(0.1, 600.0)] | None = None

    def before(self, general: Limits) -> Limits:
        """Return these limits, with the ``general`` ones where they have none."""
        return Limits(
            general.memory if self.memory is None else self.memory,
            general.files if self.files is None else self.files,
            general.handler_timeout if self.handler_timeout is None else self.handler_timeout,
        )


@message("regraft/ComponentSpec")
@dataclass(frozen=True, slots=True)
class ComponentSpec:
    """One component as it should be. ``cls`` is ``module:Class``; a component with a ``command`` runs any program.

    ``connections`` maps every port to its topic, None for none; ``services`` maps every offered service to the name it
    is offered under. ``description`` is that of its class; None for an unmanaged process, which has no lifecycle.
    ``name`` may be left out where the spec is listed under it. Where ``limits`` have none, those of the architecture
    hold.
    """

    name: str = ""
    cls: ClassPath = ""
    command: tuple[str, ...] = ()
    host: str = "local"
    parameters: dict[str, PlainValue] = field(default_factory=dict)
    connections: Connections = field(default_factory=dict)
    services: dict[str, str] = field(default_factory=dict)
    state: State = State.ACTIVE
    restart: RestartPolicy = field(default_factory=RestartPolicy)
    managed: bool = True
    description: Description | None = None
    limits: Limits = Limits()

    def connected_ports(self) -> Iterator[tuple[PortDescription, str]]:
        """Yield every described port that is connected, with its topic."""
        for port in self.description.ports if self.description else ():
            topic = self.connections.get(port.name)
            if topic:
                yield port, topic

    def brief(self, known: ComponentSpec | None) -> ComponentSpec:
        """Return the spec without its description, for receivers that have ``known`` of the same class and
        description.
        """
        alike = known is not None and known.cls == self.cls and known.description == self.description
        return replace(self, description=None) if alike else self

    def described_as(self, known: ComponentSpec | None) -> ComponentSpec:
        """Return the spec with the description that ``known`` has of the same class, if it has none of its own."""
        if self.description is not None or known is None or known.cls != self.cls:
            return self
        return replace(self, description=known.description)


@message("regraft/HostRules")
@dataclass(frozen=True, slots=True)
class HostRules:
    """A host's offer, and what becomes of its components when it is lost.

    ``lost_after`` seconds without a sign of life from a host count as its loss. ``move_to`` names the host that its
    components are then started on; empty: they wait for its return. ``cpu`` (cores) and ``memory`` (MiB) are
    what its components may need together; None: no limit. ``amounts`` are all others that it offers, by name.
    ``devices`` are those that it has for a component that needs one for itself.
    """

    move_to: str = ""
    lost_after: Annotated[Seconds, Bounds(0.5, 3600.0)] = 3.0
    cpu: Annotated[float, Bounds(0.0)] | None = None
    memory: Annotated[float, Bounds(0.0)] | None = None
    devices: tuple[str, ...] = ()
    amounts: Amounts = field(default_factory=dict)


class ConstraintKind(Enum):
    """The kind of a constraint."""

    AT_LEAST_ONE_ACTIVE = "at_least_one_active"
    AT_MOST_ONE_ACTIVE = "at_most_one_active"
    PARAMETER = "parameter"
    REQUIRE = "require"
    PROVIDED = "provided"


@message("regraft/Constraint")
@dataclass(frozen=True, slots=True)
class Constraint:
    """A rule of the stack's own, which every adaptation must keep; ``because`` is shown when one does not.

    ``expression`` is what must be so (`regraft.bus_schema.model.expressions`), ``services`` are what an active
    component must offer.
    """

    kind: ConstraintKind
    components: tuple[str, ...] = ()
    parameter: str = ""
    minimum: float | None = None
    maximum: float | None = None
    because: str = ""
    expression: str = ""
    services: tuple[str, ...] = ()


@message("regraft/Architecture")
@dataclass(frozen=True, slots=True)
class Architecture:
    """All components, topics, hosts and constraints of a system, under one revision.

    ``modes`` has the changes that enter each mode, as plain data in the form of `regraft/AdaptationRequest`'s. A host
    without ``host_rules`` has the usual ones. ``unconfirmed`` is the id of the adaptation that gave the revision, while
    that is not final; empty once it is. ``limits`` hold for every component without its own. ``mode_parts`` has the
    modes of other parts that a mode enters, and ``mode_rules`` are for the mode planner. ``asked_modes`` is the mode
    that was asked for last, by part (`regraft.bus_schema.model.modes.mode_parts`). ``robots`` are the names of the
    robots whose names are their own: they are scopes even without topics.
    """

    system: str
    revision: Count
    simulated: bool
    components: dict[str, ComponentSpec]
    topics: dict[str, TopicSpec]
    hosts: tuple[str, ...] = ("local",)
    constraints: tuple[Constraint, ...] = ()
    modes: dict[str, PlainValue] = field(default_factory=dict)
    host_rules: dict[str, HostRules] = field(default_factory=dict)
    unconfirmed: str = ""
    limits: Limits = Limits()
    mode_parts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    mode_rules: tuple[ModeRule, ...] = ()
    asked_modes: dict[str, str] = field(default_factory=dict)
    robots: tuple[str, ...] = ()

    @property
    def scopes(self) -> frozenset[str]:
        """The scopes that components may be in (`regraft.bus_schema.model.robots.scopes`)."""
        return scopes_in(self.topics, self.robots)

    def handler_timeout(self, spec: ComponentSpec) -> float:
        """Return how many seconds a handler or hook may keep its component's loop, 0 if unknown."""
        limit = spec.limits.before(self.limits).handler_timeout
        if limit is not None:
            return limit
        return spec.description.handler_timeout if spec.description else 0.0

    def rules(self, host: str) -> HostRules:
        """Return the rules of a host."""
        return self.host_rules.get(host) or HostRules()

    def with_hosts(self, names: Iterable[str]) -> Architecture:
        """Return the architecture with further hosts; the revision stays."""
        hosts = tuple(dict.fromkeys((*self.hosts, *names)))
        return self if hosts == self.hosts else replace(self, hosts=hosts)

    def with_component(self, spec: ComponentSpec) -> Architecture:
        """Return the architecture with one component replaced or added; the revision stays."""
        return replace(self, components={**self.components, spec.name: spec})

    def without(self, components: Collection[str]) -> Architecture:
        """Return the architecture without some components; the revision stays."""
        return replace(self, components={n: spec for n, spec in self.components.items() if n not in components})

    def with_topics(self, added: Iterable[TopicSpec], removed: Collection[str] = ()) -> Architecture:
        """Return the architecture with topics added or replaced, and others removed; the revision stays."""
        added = tuple(added)
        if not added and not removed:
            return self
        topics = {name: topic for name, topic in self.topics.items() if name not in removed}
        return replace(self, topics=topics | {topic.name: topic for topic in added})

    def writers(self, topic: str) -> tuple[tuple[str, str], ...]:
        """Return (component, port) of every output connected to ``topic``, by name."""
        return self._ends(topic, "output")

    def readers(self, topic: str) -> tuple[tuple[str, str], ...]:
        """Return (component, port) of every input connected to ``topic``, by name."""
        return self._ends(topic, "input")

    def _ends(self, topic: str, direction: str) -> tuple[tuple[str, str], ...]:
        return tuple(
            (spec.name, port.name)
            for spec in sorted(self.components.values(), key=lambda spec: spec.name)
            for port, connected in spec.connected_ports()
            if port.direction == direction and connected == topic
        )


def scopes_in(topics: Iterable[str], robots: Iterable[str] = ()) -> frozenset[str]:
    """Return the scopes of a system: the names of its robots, and all that its topics begin with.

    >>> sorted(scopes_in(["map", "rescuer/scan"], ["arm"]))
    ['arm', 'rescuer']
    """
    return frozenset(filter(None, (*robots, *(topic.partition("/")[0] for topic in topics if "/" in topic))))
