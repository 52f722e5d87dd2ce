"""Mistakes in what was typed: changes that name what is not there, or have a value that does not fit.

They are found before anybody is asked, so they leave no line in the journal. All else that can be wrong with an
adaptation is judged by the adaptation manager.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.host import DescribeComponent, DescribedComponent
from regraft.bus_schema.model.adaptation import (
    AdaptationRequest,
    Add,
    Change,
    ChangeState,
    Connect,
    EnterMode,
    Move,
    Remove,
    SetParameters,
    Swap,
    Violation,
)
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.lifecycle import TRANSITIONS
from regraft.bus_schema.model.parameter_values import effective_parameter, parameter_problem
from regraft.bus_schema.model.watch_checks import watch_violations
from regraft.bus_schema.model.wiring import connection_problem
from regraft.bus_schema.suggestions import instead_of, no_such
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import Reached
from regraft.cli.terminal.values import line_of
from regraft.cli.topology import Topology
from regraft.client import ClientError
from regraft.stack.yaml.nodes import Location

DESCRIBED_TIMEOUT = 25.0
"""Seconds that a host may take to import a class and describe it."""

STARTED = ("class", "command")
"""The fields of a spec that name what is started."""

NO_FILE: Mapping[str, Location] = MappingProxyType({})

Describe = Callable[[ComponentSpec], DescribedComponent | None]


def refuse_mistakes(there: Reached, request: AdaptationRequest, locations: Mapping[str, Location] = NO_FILE) -> None:
    """Raise BadInput with every mistake in a request to change a system's architecture, one a line.

    ``locations`` are those of the request's fields in its file.
    """

    def describe(spec: ComponentSpec) -> DescribedComponent | None:
        return _described(there, spec)

    draft = _Draft(dict(there.known.hosted), dict(there.known.topics), there.known, describe)
    found = [
        f"change {index}: {problem}" if len(request.changes) > 1 else problem
        for index, problem in draft.take_all(request.changes)
    ]
    # A change that means nothing leaves components of which nothing is known.
    watched = [] if found else watch_violations(request.watch, request.confirm, draft.components)
    found += [violation_line(violation, locations) for violation in watched]
    if found:
        raise BadInput("\n".join(found))


def refuse_values(spec: ComponentSpec, values: Mapping[str, PlainValue], *, starting: bool = False) -> None:
    """Raise BadInput with every value that a component's parameters do not take, one a line.

    One that is ``starting`` takes values of read-only parameters too.
    """
    found = list(_of_values(spec, values, starting=starting))
    if found:
        raise BadInput("\n".join(found))


def mistakes(changes: Sequence[Change], known: Topology, describe: Describe) -> Iterator[tuple[int, str]]:
    """Yield every mistake with the index of its change; each change sees what those before it will have done.

    ``describe`` gives what a class states of itself, None if that is unknown: it is left to the manager then.
    """
    yield from _Draft(dict(known.hosted), dict(known.topics), known, describe).take_all(changes)


def violation_line(violation: Violation, locations: Mapping[str, Location] = NO_FILE) -> str:
    """Return a violation as one line; one of a condition that is watched is led by its place in the request's file."""
    place = line_of(violation.field.split("."), locations) if is_of_watch(violation) else ""
    number = "" if violation.change is None else f"change {violation.change}"
    return ": ".join(filter(None, (place, number, str(violation))))


def is_of_watch(violation: Violation) -> bool:
    """Return whether a violation is about the conditions that are to be watched."""
    return violation.field.split(".")[0] == "watch"


@dataclass(slots=True)
class _Draft:
    """The components and topics as the changes so far leave them."""

    components: dict[str, ComponentSpec]
    topics: dict[str, TopicSpec]
    known: Topology
    describe: Describe

    def take_all(self, changes: Sequence[Change]) -> Iterator[tuple[int, str]]:
        """Yield what is wrong with changes, each with its index, and take them over."""
        for index, change in enumerate(changes):
            for problem in self.take(change, changes):
                yield index, problem

    def take(self, change: Change, changes: Sequence[Change]) -> Iterator[str]:
        """Yield what is wrong with a change, and take it over."""
        if isinstance(change, EnterMode):
            if change.mode not in self.known.modes:
                yield no_such("mode", change.mode, self.known.modes)
            else:
                self._enter(change.mode)
            return
        if isinstance(change, Add):
            yield from self._add(change)
            return
        spec = self.components.get(change.component)
        if spec is None:
            yield no_such("component", change.component, self.components)
        elif isinstance(change, SetParameters):
            yield from _of_values(spec, change.parameters)
        elif isinstance(change, Connect):
            yield from self._of_ports(spec, {change.port: change.topic})
        elif isinstance(change, ChangeState):
            reached = {end for (_, transition), (_, end) in TRANSITIONS.items() if transition is change.transition}
            self.components[spec.name] = replace(spec, state=reached.pop())
        elif isinstance(change, Move):
            yield from self._of_host(change.host)
        elif isinstance(change, Swap):
            yield from self._swap(change, spec, changes)
        elif isinstance(change, Remove):
            yield from self._remove(change)

    def _enter(self, mode: str) -> None:
        """Take over the changes of a mode. The stack's check has judged them: what is not needed now is no mistake."""
        with suppress(BadMessage):
            changes = codec.from_plain({"changes": self.known.modes[mode]}, AdaptationRequest).changes
            deque(self.take_all(changes), maxlen=0)

    def _of_host(self, host: str) -> Iterator[str]:
        if host not in self.known.hosts:
            yield no_such("host", host, self.known.hosts)

    def _of_ports(self, spec: ComponentSpec, connections: Mapping[str, str | None]) -> Iterator[str]:
        if spec.description is None:
            return
        names = [port.name for port in spec.description.ports]
        for name, topic in connections.items():
            port = spec.description.port(name)
            if port is None:
                yield f"{spec.name} has no port {name!r}; {instead_of(name, names)}"
                continue
            problem = connection_problem(self.topics, port, topic) if topic is not None else None
            if problem is not None:
                yield f"{spec.name}: {problem}"

    def _remove(self, change: Remove) -> Iterator[str]:
        for topic in change.topics:
            if topic not in self.topics:
                yield no_such("topic", topic, self.topics)
        self.components.pop(change.component)
        self.topics = {name: topic for name, topic in self.topics.items() if name not in change.topics}

    def _swap(self, change: Swap, spec: ComponentSpec, changes: Sequence[Change]) -> Iterator[str]:
        host = next((c.host for c in changes if isinstance(c, Move) and c.component == spec.name), spec.host)
        new, given = replace(spec, host=host), dict(change.parameters)
        if change.cls not in ("", spec.cls) or _decides_on_ports(spec.description, change.parameters):
            parameters = spec.parameters | change.parameters
            new, problems = self._start(replace(new, cls=change.cls, parameters=parameters, description=None))
            yield from problems
            given = {name: new.parameters[name] for name in given}
        yield from _of_values(new, given, starting=True)
        yield from self._of_ports(new, change.connections)
        self.components[spec.name] = new

    def _add(self, change: Add) -> Iterator[str]:
        self.topics = self.topics | {topic.name: topic for topic in change.topics}
        spec, problems = self._start(replace(change.spec, name=change.component, description=None))
        yield from problems
        yield from _of_values(spec, spec.parameters, starting=True)
        yield from self._of_ports(spec, change.spec.connections)
        self.components.setdefault(change.component, spec)

    def _start(self, spec: ComponentSpec) -> tuple[ComponentSpec, list[str]]:
        """Return what a host would start, with what its class states, and why it cannot."""
        problems = list(self._of_host(spec.host))
        described = None if problems else self.describe(spec)
        if described is None:
            return spec, problems
        told = [f"{spec.name}: {violation.problem}" for violation in described.violations if violation.field in STARTED]
        return described.spec, told


def _decides_on_ports(description: Description | None, values: Mapping[str, PlainValue]) -> bool:
    """Return whether values may give the class other ports than it has: those of parameters that are read-only."""
    return description is not None and any(p.read_only for p in description.parameters if p.name in values)


def _of_values(spec: ComponentSpec, values: Mapping[str, PlainValue], *, starting: bool = False) -> Iterator[str]:
    description, name = spec.description, spec.name
    if description is None:
        return
    known = [parameter.name for parameter in description.parameters]
    for parameter, value in values.items():
        described = description.parameter(parameter)
        if described is None:
            yield f"{name} has no parameter {parameter!r}; {instead_of(parameter, known)}"
            continue
        problem = parameter_problem(described, value)
        if problem is not None:
            yield f"{name}.{parameter} = {problem}"
        elif (
            described.read_only
            and not starting
            and value != effective_parameter(description, spec.parameters, parameter)
        ):
            yield f"{name}.{parameter} is read-only, set when the component starts: swap the component to change it"


def _described(there: Reached, spec: ComponentSpec) -> DescribedComponent | None:
    """Ask the host that would run it; None if it does not know: the adaptation manager judges then."""
    asked = DescribeComponent(spec)
    try:
        return there.client.ask_host(spec.host, "describe", asked, DescribedComponent, DESCRIBED_TIMEOUT)
    except ClientError:
        return None
