"""Checks where components are placed: on hosts that there are, and within what these offer."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.model.adaptation import ADAPT, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.suggestions import instead_of

LOCAL = "local"
"""The name of a system's first host, which the others join."""


def host_violations(architecture: Architecture) -> Iterator[Violation]:
    """Yield everything that is wrong with hosts: unknown ones, rules that cannot be kept, too much on one."""
    for name, spec in sorted(architecture.components.items()):
        if spec.host not in architecture.hosts:
            problem = f"there is no host {spec.host!r}; {instead_of(spec.host, architecture.hosts)}"
            yield Violation(None, name, "host", problem)
    yield from _rules(architecture)
    yield from _limits(architecture)


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


def _limits(architecture: Architecture) -> Iterator[Violation]:
    for host, rules in sorted(architecture.host_rules.items()):
        there = [spec for _, spec in sorted(architecture.components.items()) if spec.host == host and _counts(spec)]
        for what, unit, limit in (("cpu", "cores", rules.cpu), ("memory", "MiB", rules.memory)):
            needs = {spec.name: _need(spec, what) for spec in there}
            total = sum(needs.values())
            if limit is not None and total > limit * (1.0 + 1e-9):
                most = ", ".join(f"{name} {needs[name]:g}" for name in sorted(needs, key=lambda n: -needs[n])[:5])
                problem = f"offers {limit:g} {unit}, but its components need {total:g} ({most})"
                yield Violation(None, "", f"hosts.{host}.{what}", f"{problem}: place some of them elsewhere")


def _counts(spec: ComponentSpec) -> bool:
    return spec.description is not None and spec.state is not State.FINALIZED


def _need(spec: ComponentSpec, what: str) -> float:
    return float(getattr(spec.description.resources, what)) if spec.description else 0.0
