"""What is to be started, as the hosts that are to run it see it: the manager itself imports no author's class."""

from __future__ import annotations

from dataclasses import replace

from adaptation_manager.controls import ControlFailed
from adaptation_manager.hosts import Hosts
from bus_schema.adaptation import AdaptationRequest, Add, Change, Move, Swap, Violation
from bus_schema.architecture import Architecture, ComponentSpec
from bus_schema.messages.host import DescribedComponent
from bus_schema.suggestions import instead_of

PATH = "path"
"""The unit of a parameter whose value the host completes."""


async def described_additions(
    request: AdaptationRequest, architecture: Architecture, hosts: Hosts
) -> tuple[dict[int, DescribedComponent], list[Violation]]:
    """Return each component to be started as its host describes it, by its change's index, and all that is wrong."""
    described: dict[int, DescribedComponent] = {}
    found: list[Violation] = []
    for index, change in enumerate(request.changes):
        if isinstance(change, Add):
            wanted: ComponentSpec | None = replace(change.spec, name=change.component)
        else:
            wanted = _successor(change, architecture, hosts)
        if wanted is None:
            continue
        violations = _of_spec(wanted, architecture)
        if not violations and isinstance(change, Swap) and _is_known(change, wanted):
            described[index] = DescribedComponent(wanted)
        elif not violations:
            try:
                described[index] = await hosts.describe(wanted, request.context)
            except ControlFailed as error:
                violations = [Violation(None, "", "cls" if wanted.cls else "command", str(error))]
            else:
                violations = list(described[index].violations)
        found += [replace(violation, change=index, component=change.component) for violation in violations]
    return described, found


def _of_spec(spec: ComponentSpec, architecture: Architecture) -> list[Violation]:
    if spec.host not in architecture.hosts:
        problem = f"there is no host {spec.host!r}; {instead_of(spec.host, architecture.hosts)}"
        return [Violation(None, "", "host", problem)]
    if bool(spec.cls) == bool(spec.command):
        return [Violation(None, "", "cls", "a component has either a class or a command")]
    return []


def _successor(change: Change, architecture: Architecture, hosts: Hosts) -> ComponentSpec | None:
    """Return what a swap or move starts, with all parameters of before: the host takes those that decide on its ports.

    None for what can only be refused, and for what is started on another host because its own is lost.
    """
    spec = architecture.components.get(change.component)
    if spec is None or not spec.cls:
        return None
    if isinstance(change, Move):
        stays = spec.host in (change.host, *hosts.lost) or change.host in hosts.absent()
        return None if stays else replace(spec, host=change.host, description=None)
    if not isinstance(change, Swap):
        return None
    return replace(
        spec,
        cls=change.cls or spec.cls,
        parameters=spec.parameters | change.parameters,
        services=change.services,
        description=spec.description if change.cls in ("", spec.cls) else None,
    )


def _is_known(change: Swap, spec: ComponentSpec) -> bool:
    """Tell whether the description of before is that of the successor, and no value needs completing."""
    if spec.description is None:
        return False
    given = [parameter for parameter in spec.description.parameters if parameter.name in change.parameters]
    return not any(parameter.read_only or parameter.unit == PATH for parameter in given)
