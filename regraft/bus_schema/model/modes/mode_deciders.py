"""The component that enforces the rules of modes: a system has at most one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import ComponentSpec

DECIDER = "modes/decider"
"""The service by which a component shows that it enforces rules, under any offered name."""


def deciders(specs: Iterable[ComponentSpec]) -> list[str]:
    """Return the components that enforce rules, by name."""
    described = ((spec.name, spec.description.services if spec.description else ()) for spec in specs)
    return sorted(name for name, services in described if any(each.name == DECIDER for each in services))


def decider_violations(specs: Iterable[ComponentSpec]) -> Iterator[Violation]:
    """Yield every component that would enforce rules next to another one."""
    found = deciders(specs)
    for name in found[1:]:
        both = " and ".join(map(repr, found))
        problem = f"a system has one component that decides on modes, not {both}: swap it, or remove it first"
        yield Violation(None, name, f"services.{DECIDER}", problem)
