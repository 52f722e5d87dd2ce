"""Components to be started, as their future hosts see them: the manager itself imports no author's class."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from regraft.adaptation_manager.steps.succession import move_of, swap_of
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.messages.protocol.host import DescribedComponent
from regraft.bus_schema.model.adaptation import AdaptationRequest, Add, Change, Move, Swap, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.suggestions import instead_of


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
            wanted = _successor(change, request.changes, architecture, hosts)
        if wanted is None:
            continue
        violations = _of_spec(wanted, architecture)
        if not violations and isinstance(change, Swap) and _is_known(change, wanted):
            described[index] = DescribedComponent(wanted)
        elif not violations:
            try:
                described[index] = await hosts.describe(wanted)
            except ControlFailed as error:
                violations = [Violation(None, "", "class" if wanted.cls else "command", str(error))]
            else:
                violations = list(described[index].violations)
        found += [replace(violation, change=index, component=change.component) for violation in violations]
    return described, found


def _of_spec(spec: ComponentSpec, architecture: Architecture) -> list[Violation]:
    if spec.host not in architecture.hosts:
        problem = f"there is no host {spec.host!r}; {instead_of(spec.host, architecture.hosts)}"
        return [Violation(None, "", "host", problem)]
    if bool(spec.cls) == bool(spec.command):
        return [Violation(None, "", "class", "a component has either a class or a command")]
    return []


def _successor(
    change: Change, changes: Sequence[Change], architecture: Architecture, hosts: Hosts
) -> ComponentSpec | None:
    """Return what a swap or move starts, with all previous parameters: the host takes those that decide on its ports.

    None where the change can only be refused, or where a lost host makes another one start it. None also for a move of
    a component that is swapped too: the swap starts it there.
    """
    spec = architecture.components.get(change.component)
    if spec is None or not spec.cls:
        return None
    if isinstance(change, Move):
        stays = spec.host in (change.host, *hosts.lost) or change.host in hosts.absent()
        swapped = swap_of(changes, spec.name) is not None and change.host in architecture.hosts
        return None if stays or swapped else replace(spec, host=change.host, description=None)
    if not isinstance(change, Swap):
        return None
    moved = move_of(changes, spec.name)
    host = moved.host if moved else spec.host
    if host != spec.host and (host not in architecture.hosts or host in hosts.absent()):
        return None
    is_described = host == spec.host and change.cls in ("", spec.cls)
    return replace(
        spec,
        cls=change.cls or spec.cls,
        host=host,
        parameters=spec.parameters | change.parameters,
        services=change.services,
        description=spec.description if is_described else None,
    )


def _is_known(change: Swap, spec: ComponentSpec) -> bool:
    """Return whether the previous description is that of the successor, and no value needs completing."""
    if spec.description is None:
        return False
    given = [parameter for parameter in spec.description.parameters if parameter.name in change.parameters]
    return not any(parameter.read_only or parameter.names_files for parameter in given)
