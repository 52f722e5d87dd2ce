"""What is to be added, as the hosts that are to run it see it: the manager itself imports no author's class."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from adaptation_manager.controls import ControlFailed
from adaptation_manager.hosts import Hosts
from bus_schema.adaptation import Add, Change, Violation
from bus_schema.architecture import Architecture
from bus_schema.messages.host import DescribedComponent
from bus_schema.suggestions import instead_of


async def described_additions(
    changes: Sequence[Change], architecture: Architecture, hosts: Hosts
) -> tuple[dict[int, DescribedComponent], list[Violation]]:
    """Return each component to be added as its host describes it, by its change's index, and all that is wrong."""
    described: dict[int, DescribedComponent] = {}
    found: list[Violation] = []
    for index, change in enumerate(changes):
        if not isinstance(change, Add):
            continue
        name, spec = change.component, replace(change.spec, name=change.component)
        if spec.host not in architecture.hosts:
            problem = f"there is no host {spec.host!r}; {instead_of(spec.host, architecture.hosts)}"
            found.append(Violation(index, name, "host", problem))
            continue
        if bool(spec.cls) == bool(spec.command):
            found.append(Violation(index, name, "cls", "a component has either a class or a command"))
            continue
        try:
            described[index] = await hosts.describe(spec)
        except ControlFailed as error:
            found.append(Violation(index, name, "cls" if spec.cls else "command", str(error)))
            continue
        found += [replace(violation, change=index, component=name) for violation in described[index].violations]
    return described, found
