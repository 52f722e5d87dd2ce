"""What an option means in an architecture: whether it can be, whether it stands, what must be changed for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from adaptation_manager.planners.bandits.dimensions import Dimension, Kind, identity
from bus_schema.adaptation import Change, ChangeState, Connect, SetParameters
from bus_schema.annotations import PlainValue
from bus_schema.architecture import Architecture, ComponentSpec
from bus_schema.lifecycle import State, Transition, route
from bus_schema.parameter_values import effective_parameter, parameter_problem
from bus_schema.suggestions import instead_of

LEADS_TO: Final = {
    "configure": State.INACTIVE,
    "activate": State.ACTIVE,
    "deactivate": State.INACTIVE,
    "cleanup": State.UNCONFIGURED,
}
"""The state that a transition stands for as an option; one that takes several transitions gets them."""


def problems(dimensions: Sequence[Dimension], architecture: Architecture) -> Iterator[str]:
    """Yield what of the dimensions cannot be in an architecture, and what could."""
    for index, dimension in enumerate(dimensions):
        spec = architecture.components.get(dimension.component)
        if spec is None:
            missing = f"there is no component {dimension.component!r}"
            yield f"options.{index}.component: {missing}; {instead_of(dimension.component, architecture.components)}"
        elif dimension.kind is Kind.PARAMETER:
            yield from (f"options.{index}.{problem}" for problem in _parameter_problems(dimension, spec))
        elif dimension.kind is Kind.PORT:
            yield from (f"options.{index}.{problem}" for problem in _port_problems(dimension, spec, architecture))


def _parameter_problems(dimension: Dimension, spec: ComponentSpec) -> Iterator[str]:
    known = spec.description.parameters if spec.description else ()
    described = next((parameter for parameter in known if parameter.name == dimension.member), None)
    if described is None:
        missing = f"{spec.name} has no parameter {dimension.member!r}"
        yield f"parameter: {missing}; {instead_of(dimension.member, [p.name for p in known])}"
    elif described.read_only:
        yield f"parameter: {dimension.name} is read-only"
    else:
        wrong = (parameter_problem(described, value) for value in dimension.choices)
        yield from (f"values: {problem}" for problem in wrong if problem)


def _port_problems(dimension: Dimension, spec: ComponentSpec, architecture: Architecture) -> Iterator[str]:
    if dimension.member not in spec.connections:
        missing = f"{spec.name} has no port {dimension.member!r}"
        yield f"port: {missing}; {instead_of(dimension.member, spec.connections)}"
    for topic in dimension.choices:
        if topic not in architecture.topics:
            yield f"topics: there is no topic {topic!r}; {instead_of(topic, architecture.topics)}"


def stands(dimension: Dimension, value: PlainValue, architecture: Architecture) -> bool:
    """Tell whether a dimension has a value in an architecture."""
    spec = architecture.components.get(dimension.component)
    if spec is None:
        return False
    if dimension.kind is Kind.PORT:
        return spec.connections.get(dimension.member) == str(value)
    if dimension.kind is Kind.TRANSITION:
        return spec.state is LEADS_TO[value]
    if spec.description is None:
        return False
    return identity(effective_parameter(spec.description, spec.parameters, dimension.member)) == identity(value)


def changes_for(
    dimensions: Sequence[Dimension], values: Sequence[PlainValue], architecture: Architecture
) -> tuple[Change, ...]:
    """Return what must be changed in an architecture so that an option stands; nothing if it does."""
    parameters: dict[str, dict[str, PlainValue]] = {}
    others: list[Change] = []
    for dimension, value in zip(dimensions, values, strict=True):
        if stands(dimension, value, architecture):
            continue
        component = dimension.component
        if dimension.kind is Kind.PARAMETER:
            parameters.setdefault(component, {})[dimension.member] = value
        elif dimension.kind is Kind.PORT:
            others.append(Connect(component, dimension.member, value))
        else:
            way = route(architecture.components[component].state, LEADS_TO[value]) or (Transition(value),)
            others += [ChangeState(component, transition) for transition in way]
    return (*(SetParameters(component, values) for component, values in parameters.items()), *others)
