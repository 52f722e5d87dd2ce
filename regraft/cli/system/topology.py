"""The connections of a system: from the hosts' specs, and of components that no host runs, from themselves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.description import ANY_TYPE, PortDescription, ServiceDescription
from regraft.bus_schema.model.hosts import LOCAL
from regraft.bus_schema.suggestions import instead_of
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import Reached
from regraft.client import NoAnswer, NoSuchComponent

AT_ONCE = 0.0
"""Components are known at once; only their descriptions take time to arrive."""


@dataclass(slots=True)
class TopicUse:
    """A topic: its type, who writes and who reads it as (component, port), and what the stack states of it."""

    name: str
    type: str
    spec: TopicSpec | None = None
    writers: list[tuple[str, str]] = field(default_factory=list)
    readers: list[tuple[str, str]] = field(default_factory=list)

    def plain(self) -> dict[str, object]:
        """Return it as plain data."""
        return {
            "name": self.name,
            "type": self.type,
            "reliable": self.spec.reliable if self.spec else None,
            "rate": self.spec.rate if self.spec else None,
            "writers": [ends(*end) for end in self.writers],
            "readers": [ends(*end) for end in self.readers],
        }


@dataclass(frozen=True, slots=True)
class Offer:
    """A service or action that a component offers under a name."""

    name: str
    component: str
    description: ServiceDescription

    def plain(self) -> dict[str, object]:
        """Return it as plain data."""
        said = self.description
        return {
            "name": self.name,
            "kind": said.kind,
            "component": self.component,
            "request": said.request,
            "reply": said.reply,
            "feedback": said.feedback,
            "description": said.description,
        }


@dataclass(frozen=True, slots=True)
class Topology:
    """The components of a system as specs, those that hosts run and the others; the stack's topics, hosts and modes."""

    hosted: dict[str, ComponentSpec]
    unhosted: dict[str, ComponentSpec]
    topics: dict[str, TopicSpec]
    hosts: frozenset[str] = frozenset()
    modes: frozenset[str] = frozenset()

    @property
    def components(self) -> dict[str, ComponentSpec]:
        """All components by name."""
        return dict(sorted((self.unhosted | self.hosted).items()))

    def component(self, name: str) -> ComponentSpec:
        """Return a component; raises BadInput for an unknown one."""
        found = self.components.get(name)
        if found is None:
            raise BadInput(no_component(name, self.components))
        return found

    def uses(self) -> dict[str, TopicUse]:
        """Return all topics by name."""
        uses = {name: TopicUse(name, spec.type, spec) for name, spec in self.topics.items()}
        # A port that takes any type cannot say which one the topic has.
        for component, port, topic in sorted(self._ports(), key=lambda end: end[1].type == ANY_TYPE):
            use = uses.setdefault(topic, TopicUse(topic, port.type))
            (use.writers if port.direction == "output" else use.readers).append((component, port.name))
        return dict(sorted(uses.items()))

    def use(self, topic: str) -> TopicUse:
        """Return one topic; raises BadInput for an unknown one."""
        uses = self.uses()
        if topic not in uses:
            raise BadInput(f"there is no topic {topic!r}; {instead_of(topic, uses)}")
        return uses[topic]

    def _ports(self) -> Iterator[tuple[str, PortDescription, str]]:
        for name, spec in self.components.items():
            for port in spec.description.ports if spec.description else ():
                topic = spec.connections.get(port.name)
                if topic:
                    yield name, port, topic

    def offers(self, kind: str | None = None) -> dict[str, Offer]:
        """Return what is offered, by name: all, or only each ``service`` or ``action``."""
        offers = (
            Offer(spec.services.get(said.name, said.name), name, said)
            for name, spec in self.components.items()
            for said in (spec.description.services if spec.description else ())
            if kind in (None, said.kind)
        )
        return {offer.name: offer for offer in sorted(offers, key=lambda offer: offer.name)}

    def offer(self, name: str, kind: str) -> Offer:
        """Return one service or action; raises BadInput for an unknown one."""
        offers = self.offers(kind)
        if name not in offers:
            raise BadInput(f"there is no {kind} {name!r}; {instead_of(name, offers)}")
        return offers[name]


def no_component(name: str, known: Iterable[str]) -> str:
    """Report that a component is not there, and which may be meant."""
    return f"there is no component {name!r}; {instead_of(name, known)}"


def ends(component: str, port: str) -> str:
    """Return a port as it is shown: ``component.port``."""
    return f"{component}.{port}"


def topology(there: Reached) -> Topology:
    """Ask who is connected to what; raises ClientError."""
    client = there.client
    seen = client.components(AT_ONCE)
    hosted: dict[str, ComponentSpec] = {}
    topics: dict[str, TopicSpec] = {}
    elsewhere: dict[str, ComponentSpec] = {}
    hosts: set[str] = set()
    modes: frozenset[str] = frozenset()
    for host in client.hosts(AT_ONCE).values():
        hosts.add(host.name)
        if not host.alive:
            continue
        try:
            view = client.host_view(host.name)
        except NoAnswer:
            if host.name == LOCAL:
                raise
            continue  # it is lost, or on the way to that: the first host knows what it was to run
        hosted |= {spec.name: spec for spec in view.specs}
        topics |= view.architecture.topics
        if host.name == LOCAL:
            elsewhere = {name: spec for name, spec in view.architecture.components.items() if spec.host != LOCAL}
            hosts.update(view.architecture.hosts)
            modes = frozenset(view.architecture.modes)
    hosted = elsewhere | hosted
    unhosted = {}
    for name in seen.keys() - hosted.keys():
        spec = _spec_of(there, name)
        if spec is not None:
            unhosted[name] = spec
    return Topology(hosted, unhosted, topics, frozenset(hosts), modes)


def _spec_of(there: Reached, name: str) -> ComponentSpec | None:
    """Ask a component that no host runs what it is; None if it has just ended."""
    try:
        description = there.client.describe(name)
        view = there.client.view(name)
    except NoSuchComponent:
        return None
    connections = {port: topic for port, topic in view.connections.items() if topic}
    services = {offered.name: offered.name for offered in description.services}
    return ComponentSpec(
        name,
        description.cls,
        parameters=view.parameters,
        connections=connections,
        services=services,
        description=description,
        state=view.state,
    )
