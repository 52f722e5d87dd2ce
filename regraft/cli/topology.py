"""The connections of a system: from the hosts' specs, and of components that no host runs, from themselves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec, scopes_in
from regraft.bus_schema.model.description import ANY_TYPE, ServiceDescription
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.model.robots.robot_view import ALL, NoSuchRobot, RobotView, robot_view
from regraft.bus_schema.suggestions import no_such
from regraft.cli.outcomes import BadInput, Unreachable
from regraft.client import Client, ClientError, NoAnswer, NoSuchComponent, NoSuchHost

A = TypeVar("A")

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

    @property
    def users(self) -> set[str]:
        """The components that write or read it."""
        return {component for component, _ in (*self.writers, *self.readers)}

    def plain(self) -> dict[str, object]:
        """Return it as plain data."""
        return {
            "name": self.name,
            "type": self.type,
            "reliable": self.spec.reliable if self.spec else None,
            "rate": self.spec.rate if self.spec else None,
            "writers": [".".join(end) for end in self.writers],
            "readers": [".".join(end) for end in self.readers],
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
            "goals": said.goals,
            "description": said.description,
        }


@dataclass(frozen=True, slots=True)
class Topology:
    """The components of a system as specs, those that hosts run and the others; the stack's topics, hosts and modes.

    ``modes`` has the changes that enter each, as plain data. ``silent`` has components that no host runs and that do
    not describe themselves: the reason by name. ``robots`` have names of their own.
    """

    hosted: dict[str, ComponentSpec]
    unhosted: dict[str, ComponentSpec]
    topics: dict[str, TopicSpec]
    hosts: frozenset[str] = frozenset()
    modes: Mapping[str, PlainValue] = field(default_factory=dict)
    view: RobotView = ALL
    silent: Mapping[str, str] = field(default_factory=dict)
    robots: frozenset[str] = frozenset()

    @property
    def scopes(self) -> frozenset[str]:
        """The scopes that components may be in."""
        return scopes_in(self.topics, self.robots)

    def of_robot(self, robot: str) -> Topology:
        """Return what belongs to one robot, all for an empty name; raises BadInput for an unknown one."""
        try:
            return replace(self, view=robot_view(robot, self.unhosted | self.hosted, self.scopes))
        except NoSuchRobot as error:
            raise BadInput(str(error)) from None

    @property
    def components(self) -> dict[str, ComponentSpec]:
        """All components by name."""
        found = sorted((self.unhosted | self.hosted).items())
        return {name: spec for name, spec in found if self.view.has_component(name)}

    def component(self, name: str) -> ComponentSpec:
        """Return a component; raises BadInput for an unknown one, Unreachable for one that is silent."""
        if name in self.silent:
            raise Unreachable(self.silent[name])
        return named("component", name, self.components)

    def uses(self) -> dict[str, TopicUse]:
        """Return all topics by name."""
        uses = {name: TopicUse(name, spec.type, spec) for name, spec in self.topics.items()}
        # A port that takes any type does not show which one the topic has.
        everybody = sorted((self.unhosted | self.hosted).items())
        ends = [(name, port, topic) for name, spec in everybody for port, topic in spec.connected_ports()]
        for component, port, topic in sorted(ends, key=lambda end: end[1].type == ANY_TYPE):
            use = uses.setdefault(topic, TopicUse(topic, port.type))
            (use.writers if port.direction == "output" else use.readers).append((component, port.name))
        return {name: use for name, use in sorted(uses.items()) if self.view.has_topic(name, use.users)}

    def use(self, topic: str) -> TopicUse:
        """Return one topic; raises BadInput for an unknown one."""
        return named("topic", topic, self.uses())

    def offers(self, kind: str | None = None) -> dict[str, Offer]:
        """Return what is offered, by name: all, or only each ``service`` or ``action``."""
        offers = (
            Offer(offered_services(spec)[said.name], name, said)
            for name, spec in self.components.items()
            for said in (spec.description.services if spec.description else ())
            if kind in (None, said.kind)
        )
        return {offer.name: offer for offer in sorted(offers, key=lambda offer: offer.name)}

    def offer(self, name: str, kind: str) -> Offer:
        """Return one service or action; raises BadInput for an unknown one."""
        return named(kind, name, self.offers(kind))


def named(kind: str, name: str, known: Mapping[str, A]) -> A:
    """Return what has a name; raises BadInput, which lists what there is, for an unknown one."""
    if name not in known:
        raise BadInput(no_such(kind, name, known))
    return known[name]


def topology(client: Client) -> Topology:
    """Ask who is connected to what.

    Raises:
        Unreachable: the first host has just ended.
        ClientError: it does not answer.
    """
    seen = client.components(AT_ONCE)
    hosted: dict[str, ComponentSpec] = {}
    topics: dict[str, TopicSpec] = {}
    elsewhere: dict[str, ComponentSpec] = {}
    hosts: set[str] = set()
    robots: set[str] = set()
    modes: Mapping[str, PlainValue] = {}
    for host in client.hosts(AT_ONCE).values():
        hosts.add(host.name)
        if not host.alive:
            continue
        try:
            view = client.host_view(host.name)
        except (NoAnswer, NoSuchHost) as error:
            if host.name != LOCAL:
                continue  # it is lost, or on the way to that: the first host knows what it was to run
            if isinstance(error, NoSuchHost):
                raise Unreachable(f"the system has just ended: {error}") from None
            raise
        hosted |= {spec.name: spec for spec in view.specs}
        topics |= view.architecture.topics
        robots.update(view.architecture.robots)
        if host.name == LOCAL:
            elsewhere = {name: spec for name, spec in view.architecture.components.items() if spec.host != LOCAL}
            hosts.update(view.architecture.hosts)
            modes = view.architecture.modes
    hosted = elsewhere | hosted
    unhosted, silent = _specs_of(client, sorted(seen.keys() - hosted.keys()))
    return Topology(hosted, unhosted, topics, frozenset(hosts), modes, silent=silent, robots=frozenset(robots))


def _specs_of(client: Client, names: Iterable[str]) -> tuple[dict[str, ComponentSpec], dict[str, str]]:
    """Ask components that no host runs what they are; of those that do not answer, return why.

    One of them may hang, as in a debugger, and commands about the others have to work.
    """
    specs: dict[str, ComponentSpec] = {}
    silent: dict[str, str] = {}
    for name in names:
        try:
            specs[name] = _spec_of(client, name)
        except NoSuchComponent:
            continue  # it has just ended
        except ClientError as error:
            silent[name] = str(error)
    return specs, silent


def _spec_of(client: Client, name: str) -> ComponentSpec:
    """Ask a component that no host runs what it is; raises ClientError."""
    description = client.describe(name)
    view = client.view(name)
    connections = {port: topic for port, topic in view.connections.items() if topic != ""}
    return ComponentSpec(
        name,
        description.cls,
        parameters=view.parameters,
        connections=connections,
        description=description,
        state=view.state,
    )
