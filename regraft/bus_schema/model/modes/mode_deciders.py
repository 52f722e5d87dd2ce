"""The component that enforces the rules of modes: a system has at most one."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace

from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.modes.mode_conditions import NameKind, names_of
from regraft.bus_schema.model.system_topics import MEASUREMENTS

DECIDER = "modes/decider"
"""The service by which a component shows that it enforces rules, under any offered name."""


def deciders(specs: Iterable[ComponentSpec]) -> list[str]:
    """Return the components that enforce rules, by name."""
    described = ((spec.name, spec.description.services if spec.description else ()) for spec in specs)
    return sorted(name for name, services in described if any(each.name == DECIDER for each in services))


def fed_as_needed(spec: ComponentSpec, given: Collection[str], architecture: Architecture) -> ComponentSpec:
    """Return a component that enforces rules without measured qualities, where no rule speaks of one.

    Else all components would publish theirs for nobody. Its ports that are ``given`` a topic keep it.
    """
    if spec.description is None or not deciders((spec,)):
        return spec
    kinds = {known.kind for known in names_of(architecture.mode_rules, architecture).values()}
    if NameKind.QUALITY in kinds:
        return spec
    free = {port.name for port in spec.description.ports if not port.required} - set(given)
    idle = {port: None for port in free if spec.connections.get(port) == MEASUREMENTS}
    return replace(spec, connections={**spec.connections, **idle})


def decider_violations(specs: Iterable[ComponentSpec]) -> Iterator[Violation]:
    """Yield every component that would enforce rules next to another one."""
    found = deciders(specs)
    for name in found[1:]:
        both = " and ".join(map(repr, found))
        problem = f"a system has one component that decides on modes, not {both}: swap it, or remove it first"
        yield Violation(None, name, f"services.{DECIDER}", problem)
