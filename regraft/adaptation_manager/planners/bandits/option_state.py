"""An option's meaning in an architecture: whether it is possible, whether it is in force, which changes it needs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from regraft.adaptation_manager.planners.bandits.dimensions import Dimension, Kind, identity
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import Change, ChangeState, Connect, SetParameters
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State, Transition, route
from regraft.bus_schema.model.parameter_values import effective_parameter, parameter_problem
from regraft.bus_schema.suggestions import instead_of

MAX_TOLD: Final = 10
"""Problems that a refusal names."""
LEADS_TO: Final = {
    "configure": State.INACTIVE,
    "activate": State.ACTIVE,
    "deactivate": State.INACTIVE,
    "cleanup": State.UNCONFIGURED,
}
"""The state that a transition stands for as an option; one that takes several transitions gets them."""


def check_dimensions(dimensions: Sequence[Dimension], architecture: Architecture) -> None:
    """Raise BadMessage for what of the dimensions cannot be in an architecture; it says what could."""
    wrong = list(_problems(dimensions, architecture))
    if wrong:
        others = [str(problem) for problem in wrong[1:MAX_TOLD]]
        more = [f"and {len(wrong) - MAX_TOLD} more"] if len(wrong) > MAX_TOLD else []
        raise BadMessage("; ".join([wrong[0].why, *others, *more]), wrong[0].where)


def _problems(dimensions: Sequence[Dimension], architecture: Architecture) -> Iterator[BadMessage]:
    for index, dimension in enumerate(dimensions):
        spec = architecture.components.get(dimension.component)
        if spec is None:
            missing = f"there is no component {dimension.component!r}"
            why = f"{missing}; {instead_of(dimension.component, architecture.components)}"
            found = iter([BadMessage(why, ("component",))])
        elif dimension.kind is Kind.PARAMETER:
            found = _parameter_problems(dimension, spec)
        elif dimension.kind is Kind.PORT:
            found = _port_problems(dimension, spec, architecture)
        else:
            continue
        yield from (problem.inside(str(index)).inside("options") for problem in found)


def _parameter_problems(dimension: Dimension, spec: ComponentSpec) -> Iterator[BadMessage]:
    known = spec.description.parameters if spec.description else ()
    described = next((parameter for parameter in known if parameter.name == dimension.member), None)
    if described is None:
        missing = f"{spec.name} has no parameter {dimension.member!r}"
        yield BadMessage(f"{missing}; {instead_of(dimension.member, [p.name for p in known])}", ("parameter",))
    elif described.read_only:
        yield BadMessage(f"{dimension.name} is read-only", ("parameter",))
    else:
        wrong = (parameter_problem(described, value) for value in dimension.choices)
        yield from (BadMessage(problem, ("values",)) for problem in wrong if problem)


def _port_problems(dimension: Dimension, spec: ComponentSpec, architecture: Architecture) -> Iterator[BadMessage]:
    if dimension.member not in spec.connections:
        missing = f"{spec.name} has no port {dimension.member!r}"
        yield BadMessage(f"{missing}; {instead_of(dimension.member, spec.connections)}", ("port",))
    for topic in dimension.choices:
        if topic not in architecture.topics:
            why = f"there is no topic {topic!r}; {instead_of(topic, architecture.topics)}"
            yield BadMessage(why, ("topics",))


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
