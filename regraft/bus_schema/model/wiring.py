"""Checks how ports and topics fit together: names, types, versions, who feeds whom, who may write."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from regraft.bus_schema.encoding.reading_checks import reading_problem
from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.errors import BadType
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec, Writers
from regraft.bus_schema.model.description import ANY_TYPE, PortDescription
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scopes import in_scope, scope_of
from regraft.bus_schema.model.system_topics import RESERVED, SYSTEM_TOPICS
from regraft.bus_schema.suggestions import LISTED, instead_of


def wiring_violations(architecture: Architecture) -> Iterator[Violation]:
    """Yield everything wrong with the connections of ``architecture``.

    Only components that should be active write: the others feed no reader and conflict with none. A port that is not
    required may be left out of ``connections``, or have no topic. An inactive component may have any port so.
    """
    writers = _writers(architecture)
    for name, spec in sorted(architecture.components.items()):
        if spec.description is None:
            continue
        known = [port.name for port in spec.description.ports]
        for port in sorted(spec.connections.keys() - set(known)):
            problem = f"there is no port {port!r}; {instead_of(port, known)}"
            yield Violation(None, name, f"connect.{port}", problem)
        for described in spec.description.ports:
            for problem in _port_problems(architecture, writers, spec, described):
                yield Violation(None, name, _field(architecture, spec, described), problem)


def own_topic(spec: ComponentSpec, port: PortDescription, scopes: Collection[str]) -> str:
    """Return the topic that a port of a component has where nothing names another: one of the component's scope."""
    return in_scope(scope_of(spec.name, scopes), port.topic)


def _field(architecture: Architecture, spec: ComponentSpec, port: PortDescription) -> str:
    """Return the field that connects a port: for one that a parameter asks for this is the parameter, at first."""
    if port.origin and spec.connections.get(port.name) == own_topic(spec, port, architecture.scopes):
        return f"parameters.{port.origin}"
    return f"connect.{port.name}"


@dataclass(frozen=True, slots=True)
class _Writer:
    """An output that is connected to a topic."""

    spec: ComponentSpec
    port: PortDescription

    @property
    def active(self) -> bool:
        return self.spec.state is State.ACTIVE


_Writers = dict[str, list[_Writer]]


def _writers(architecture: Architecture) -> _Writers:
    """Return the writers of every topic, found at one go because adaptations wait for it."""
    found: _Writers = defaultdict(list)
    for _, spec in sorted(architecture.components.items()):
        for port, topic in spec.connected_ports():
            if port.direction == "output":
                found[topic].append(_Writer(spec, port))
    return found


def _port_problems(
    architecture: Architecture, writers: _Writers, spec: ComponentSpec, port: PortDescription
) -> Iterator[str]:
    label = f"{port.direction} {port.name!r}"
    name = spec.connections.get(port.name)
    if name is None:
        left_out = port.name not in spec.connections
        if port.required and (left_out or spec.state is State.ACTIVE):
            needed = "" if left_out else " while the component is active"
            yield f"{label} is required{needed}, but is connected to no topic; {_fitting(architecture.topics, port)}"
        return
    problem = connection_problem(architecture.topics, port, name)
    if problem is not None:
        yield problem
        return
    if name in SYSTEM_TOPICS:
        return  # it is always there, and fed by the system itself
    topic = architecture.topics[name]
    if port.type == ANY_TYPE:
        yield from _reading_problems(topic, port)
    elif port.direction == "input":
        yield from _input_problems(spec, port, name, writers.get(name, []))
    else:
        yield from _output_problems(topic, spec, port, writers.get(name, []))


def connection_problem(topics: Mapping[str, TopicSpec], port: PortDescription, name: str) -> str | None:
    """Return why a port cannot be connected to a topic of that name, regardless of others; None if it can."""
    label = f"{port.direction} {port.name!r}"
    topic = TopicSpec(name, SYSTEM_TOPICS[name]) if name in SYSTEM_TOPICS else topics.get(name)
    if name in SYSTEM_TOPICS and port.direction == "output":
        return f"{label} is connected to {name!r}, by which the system speaks of itself: components only read it"
    if topic is None:
        known = SYSTEM_TOPICS if name.startswith(RESERVED) else topics
        return f"{label} is connected to {name!r}, which is not in the topic table; {instead_of(name, known)}"
    if port.type not in (topic.type, ANY_TYPE):
        verb = "takes" if port.direction == "input" else "gives"
        return f"{label} {verb} {port.type}, but topic {name!r} carries {topic.type}; {_fitting(topics, port)}"
    return None


def _reading_problems(topic: TopicSpec, port: PortDescription) -> Iterator[str]:
    try:
        shape = type_named(topic.type).shape
    except BadType:
        yield f"input {port.name!r} cannot read topic {topic.name!r}: no message type {topic.type!r} is known here"
        return
    for reading in port.reads:
        problem = reading_problem(shape, reading)
        if problem:
            yield f"input {port.name!r} cannot read topic {topic.name!r}: {problem}"


def _input_problems(spec: ComponentSpec, port: PortDescription, topic: str, writers: list[_Writer]) -> Iterator[str]:
    for writer in writers:
        if writer.port.type == port.type and writer.port.version != port.version:
            yield (
                f"input {port.name!r} takes version {port.version} of {port.type}, but {writer.spec.name!r} "
                f"writes version {writer.port.version} to topic {topic!r}: both must have the same version"
            )
    needed = port.required and spec.state is State.ACTIVE
    if needed and not any(writer.active for writer in writers):
        yield f"input {port.name!r} is required, but {_why_unfed(topic, writers)}"


def _why_unfed(topic: str, writers: list[_Writer]) -> str:
    if not writers:
        return f"no component writes topic {topic!r}: connect an output to it, or the input to another topic"
    idle = ", ".join(f"{writer.spec.name!r} ({writer.spec.state.value})" for writer in writers)
    return f"no active component writes topic {topic!r}: activate one of {idle}, or connect the input to another topic"


def _output_problems(
    topic: TopicSpec, spec: ComponentSpec, port: PortDescription, writers: list[_Writer]
) -> Iterator[str]:
    if topic.writers is Writers.MANY or spec.state is not State.ACTIVE:
        return
    others = ", ".join(repr(writer.spec.name) for writer in writers if writer.active and writer.spec.name != spec.name)
    if others:
        yield (
            f"output {port.name!r} writes topic {topic.name!r}, as {others} does, but it may have one "
            "writer: deactivate one, connect it to another topic, or give the topic 'writers: many'"
        )


def _fitting(topics: Mapping[str, TopicSpec], port: PortDescription) -> str:
    fitting = sorted(topic.name for topic in topics.values() if port.type in (topic.type, ANY_TYPE))
    if not fitting:
        return f"no topic carries {port.type}"
    return f"topics that carry {port.type}: {', '.join(fitting[:LISTED])}"
