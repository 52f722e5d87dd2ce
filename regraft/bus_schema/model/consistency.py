"""Checks an architecture as a whole: everything that can be wrong with it before anything runs.

The stack loader and the adaptation manager ask the same function. So an adaptation leads only to what a stack may be.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Sequence

from regraft.bus_schema import keys
from regraft.bus_schema.encoding.registry import TYPE_NAME
from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.model.adaptation import Change, Connect, SetParameters, Swap, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.constraints import constraint_violations
from regraft.bus_schema.model.hosts.capability import capability_violations
from regraft.bus_schema.model.hosts.hosts import host_violations
from regraft.bus_schema.model.lifecycle import PRIMARY, State
from regraft.bus_schema.model.modes.mode_deciders import DECIDER, decider_violations
from regraft.bus_schema.model.parameter_values import parameter_problem
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.model.system_topics import RESERVED
from regraft.bus_schema.model.wiring import wiring_violations
from regraft.bus_schema.suggestions import Hints, instead_of


def violations(architecture: Architecture) -> tuple[Violation, ...]:
    """Return everything that is wrong with ``architecture``, in a stable order; empty if it is consistent.

    ``component`` is empty for what concerns topics, constraints or the system; ``field`` is a dotted path
    such as ``connections.image``, ``parameters.max_velocity``, ``topics.scan.type`` or ``constraints.0``;
    ``change`` is None.
    """
    return (
        *_system(architecture),
        *_topics(architecture),
        *(found for name, spec in sorted(architecture.components.items()) for found in _component(name, spec)),
        *_modes(architecture),
        *host_violations(architecture),
        *capability_violations(architecture),
        *_parameters(architecture, architecture.components),
        *wiring_violations(architecture),
        *_services(architecture),
        *decider_violations(architecture.components.values()),
        *constraint_violations(architecture),
    )


def value_violations(architecture: Architecture, components: Collection[str]) -> tuple[Violation, ...]:
    """Return what can be wrong with ``architecture`` because of the parameter values of some of its components."""
    return (*_parameters(architecture, components), *constraint_violations(architecture))


def _system(architecture: Architecture) -> Iterator[Violation]:
    problem = _name_problem(keys.system_name, architecture.system)
    if problem:
        yield Violation(None, "", "system", problem)


def _topics(architecture: Architecture) -> Iterator[Violation]:
    for name, topic in sorted(architecture.topics.items()):
        problem = _name_problem(keys.topic_name, name)
        if problem:
            yield Violation(None, "", f"topics.{name}", problem)
        if name.startswith(RESERVED):
            problem = f"the system itself has the topics that begin with {RESERVED!r}: name it otherwise"
            yield Violation(None, "", f"topics.{name}", problem)
        if topic.name != name:
            yield Violation(None, "", f"topics.{name}", f"is named {topic.name!r}, must be named as its key")
        if not TYPE_NAME.fullmatch(topic.type):
            yield Violation(None, "", f"topics.{name}.type", f"{topic.type!r} must look like 'package/TypeName'")


def _component(name: str, spec: ComponentSpec) -> Iterator[Violation]:
    problem = _name_problem(keys.component_name, name)
    if problem:
        yield Violation(None, name, "name", problem)
    if spec.name != name:
        yield Violation(None, name, "name", f"is {spec.name!r}, must be as its key")
    if bool(spec.cls) == bool(spec.command):
        yield Violation(None, name, "class", "a component has either a class or a command")
    if spec.cls and not spec.managed:
        yield Violation(None, name, "managed", "a component with a class is always managed")
    if spec.managed and spec.description is None:
        yield Violation(None, name, "description", "is missing: without it nothing can be checked")
    if spec.state not in PRIMARY:
        wanted = ", ".join(state.value for state in PRIMARY)
        yield Violation(None, name, "state", f"{spec.state.value!r} cannot be wanted: must be one of: {wanted}")

    yield from _own_names(name, spec)


def _own_names(name: str, spec: ComponentSpec) -> Iterator[Violation]:
    ports = spec.description.ports if spec.description else ()
    parameters = spec.description.parameters if spec.description else ()
    named = (
        ("parameters", "parameter", {*spec.parameters, *(parameter.name for parameter in parameters)}),
        ("connect", "port", {*spec.connections, *(port.name for port in ports)}),
        ("services", "service", set(offered_services(spec))),
    )
    for field, kind, names in named:
        for own in sorted(names):
            problem = _own_name_problem(own, kind)
            if problem:
                yield Violation(None, name, f"{field}.{own}", problem)


def _modes(architecture: Architecture) -> Iterator[Violation]:
    for name in sorted(architecture.modes):
        problem = _own_name_problem(name, "mode")
        if problem:
            yield Violation(None, "", f"modes.{name}", problem)


def _parameters(architecture: Architecture, components: Collection[str]) -> Iterator[Violation]:
    for name in sorted(components):
        spec = architecture.components[name]
        if spec.description is None:
            continue
        known = Hints(parameter.name for parameter in spec.description.parameters)
        for parameter, value in sorted(spec.parameters.items()):
            described = spec.description.parameter(parameter)
            if described is None:
                problem: str | None = f"there is no such parameter; {known.instead_of(parameter)}"
            else:
                problem = parameter_problem(described, value)
            if problem:
                yield Violation(None, name, f"parameters.{parameter}", problem)


def _services(architecture: Architecture) -> Iterator[Violation]:
    # A component that is not active still answers requests (it refuses them), so it conflicts, too.
    offering: dict[str, list[str]] = defaultdict(list)
    for name, spec in sorted(architecture.components.items()):
        if spec.state is not State.FINALIZED:
            for service in sorted(set(offered_services(spec).values())):
                offering[service].append(name)
    for name, spec in sorted(architecture.components.items()):
        known = [offered.name for offered in spec.description.services] if spec.description else []
        for offered, service in sorted(offered_services(spec).items()):
            for problem in _service_problems(spec, offered, known, offering.get(service, [])):
                yield Violation(None, name, f"services.{offered}", problem)


def _service_problems(spec: ComponentSpec, offered: str, known: list[str], offering: list[str]) -> Iterator[str]:
    service = offered_services(spec)[offered]
    # A program that is no component class does not describe its services, the stack names them.
    if spec.cls and spec.description and offered not in known:
        yield f"there is no service {offered!r} to offer; {instead_of(offered, known)}"
    bad_name = _name_problem(keys.service_name, service)
    if bad_name:
        yield bad_name
    same = [other for other, name in offered_services(spec).items() if name == service and other != offered]
    if same:
        yield f"is offered as {service!r}, as {same[0]!r} is: each service needs a name of its own"
    others = [name for name in offering if name != spec.name]
    if others and spec.name in offering and offered != DECIDER:
        both = ", ".join(repr(name) for name in others)
        yield f"is offered as {service!r}, as {both} does too: offer one of them under another name"


def _own_name_problem(name: str, kind: str) -> str | None:
    return _name_problem(lambda own: keys.own_name(own, kind), name)


def _name_problem(check: Callable[[str], str], name: str) -> str | None:
    try:
        check(name)
    except BadKey as error:
        return str(error)
    return None


def contradictions(changes: Sequence[Change]) -> list[Violation]:
    """Return the fields that changes made at once would have be two things."""
    wanted: dict[tuple[str, str], object] = {}
    found = []
    for index, change in enumerate(changes):
        values: dict[str, object] = {}
        if isinstance(change, SetParameters):
            values = {f"parameters.{name}": value for name, value in change.parameters.items()}
        elif isinstance(change, Connect):
            values = {f"connect.{change.port}": change.topic}
        elif isinstance(change, Swap):
            values = {f"parameters.{name}": value for name, value in change.parameters.items()}
            values |= {f"connect.{port}": topic for port, topic in change.connections.items()}
        for where, value in values.items():
            first = wanted.setdefault((change.component, where), value)
            if first != value:
                problem = f"is to be {value!r} here, but {first!r} earlier among the same changes"
                found.append(Violation(index, change.component, where, problem))
    return found
