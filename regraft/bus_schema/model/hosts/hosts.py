"""Checks where components are placed, and what is done when a host is lost."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.model.adaptation import ADAPT, Violation
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.suggestions import instead_of

LOCAL = "local"
"""The name of a system's first host, which the others join."""


def host_violations(architecture: Architecture) -> Iterator[Violation]:
    """Yield everything that is wrong with hosts: unknown ones, and rules that cannot be kept."""
    for name, spec in sorted(architecture.components.items()):
        if spec.host not in architecture.hosts:
            problem = f"there is no host {spec.host!r}; {instead_of(spec.host, architecture.hosts)}"
            yield Violation(None, name, "host", problem)
    yield from _rules(architecture)


def _rules(architecture: Architecture) -> Iterator[Violation]:
    for name, rules in sorted(architecture.host_rules.items()):
        if not rules.move_to:
            continue
        place, target = f"hosts.{name}.when_lost.move_to", rules.move_to
        if target not in architecture.hosts:
            problem = f"there is no host {target!r}; {instead_of(target, architecture.hosts)}"
            yield Violation(None, "", place, problem)
        elif target == name:
            yield Violation(None, "", place, "is the host itself: must be another")
        elif not _manager_outside(architecture, name):
            problem = f"needs an adaptation manager on another host, which offers {ADAPT!r}: without one nobody moves"
            yield Violation(None, "", place, problem)


def _manager_outside(architecture: Architecture, host: str) -> bool:
    return any(spec.host != host and ADAPT in spec.services.values() for spec in architecture.components.values())
