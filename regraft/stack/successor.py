"""A component's spec after another class, or the same with other parameters, has taken its place."""

from __future__ import annotations

from dataclasses import replace

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import Swap
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.description import Description, ParameterDescription, PortDescription
from regraft.stack.sections.components import connections, services


def successor(change: Swap, old: ComponentSpec, described: ComponentSpec, architecture: Architecture) -> ComponentSpec:
    """Return the spec after a swap: with what the old one had and the new class has too, where the swap gives nothing.

    ``described`` is the new spec with its class's description, and with what the class takes from the robot.
    """
    description = described.description
    assert description is not None
    kept = {name: topic for name, topic in old.connections.items() if _same_port(old.description, description, name)}
    values = {
        name: value for name, value in old.parameters.items() if _same_parameter(old.description, description, name)
    }
    taken = {name: value for name, value in described.parameters.items() if name not in old.parameters}
    offered = {offered.name for offered in description.services}
    named = {name: service for name, service in old.services.items() if name in offered}
    new = replace(
        old,
        cls=described.cls,
        host=described.host,
        parameters=values | taken | {name: described.parameters[name] for name in change.parameters},
        description=description,
    )
    return replace(
        new,
        connections=connections(new, architecture, kept | change.connections),
        services=services(new, architecture, named | change.services),
    )


def _same_port(old: Description | None, new: Description, name: str) -> bool:
    """Return whether both have a port of that name and direction; the topic decides whether its type fits."""
    before, behind = old.port(name) if old else None, new.port(name)
    return _direction(before) == _direction(behind) != ""


def _direction(port: PortDescription | None) -> str:
    return port.direction if port else ""


def _same_parameter(old: Description | None, new: Description, name: str) -> bool:
    """Return whether a value of the one means the same to the other; bounds are judged with all else."""
    before, behind = old.parameter(name) if old else None, new.parameter(name)
    return before is not None and behind is not None and _meaning(before) == _meaning(behind)


def _meaning(parameter: ParameterDescription) -> tuple[PlainValue, str]:
    return parameter.schema.get("type"), parameter.unit
