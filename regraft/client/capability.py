"""The capability of hosts: what each offers, what its components are declared to need, and what they take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.messages.protocol.usage import HostUsage
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.capability import UNITS, devices, loads, needs, offered
from regraft.bus_schema.model.hosts.offers import HostOffer, with_offers

NOT_ASKED: Final = "not asked for, or its host does not answer"
NO_PROCESS: Final = "no process runs"
DECLARED_ONLY: Final = "only declared: the system has no measure of it"


@dataclass(frozen=True, slots=True)
class AmountLine:
    """An amount of a host: its unit, empty where the name's documentation states it.

    ``offered`` null: no limit. ``declared`` is the sum of its components' needs. ``measured`` is what they take, null
    where that is not known, and ``why``.
    """

    name: str
    unit: str
    offered: float | None
    declared: float
    measured: float | None
    why: str = ""


@dataclass(frozen=True, slots=True)
class NeedLine:
    """An amount that a component needs of its host: declared, and measured or ``why`` that is not known."""

    name: str
    unit: str
    declared: float
    measured: float | None
    why: str = ""


@dataclass(frozen=True, slots=True)
class ComponentNeeds:
    """The amounts of a host that one component needs."""

    component: str
    amounts: tuple[NeedLine, ...]


@dataclass(frozen=True, slots=True)
class DeviceLine:
    """A device that a host offers, and the component that holds it, null if none does."""

    name: str
    holder: str | None


@dataclass(frozen=True, slots=True)
class HostCapability:
    """The amounts and devices of one host, and the part of each of its components."""

    host: str
    amounts: tuple[AmountLine, ...]
    devices: tuple[DeviceLine, ...]
    components: tuple[ComponentNeeds, ...] = ()


def capability(
    architecture: Architecture, host: str, usage: HostUsage | None = None, offer: HostOffer | None = None
) -> HostCapability:
    """Return the capability of a host, with what was measured there and what it offers itself, if these are given."""
    architecture = with_offers(architecture, {host: offer} if offer else {})
    amounts, devices_there = tuple(_amounts(architecture, host, usage)), tuple(_devices(architecture, host))
    return HostCapability(host, amounts, devices_there, tuple(_components(architecture, host, usage)))


def _amounts(architecture: Architecture, host: str, usage: HostUsage | None) -> Iterator[AmountLine]:
    load = loads((name, spec.host, needs(spec)) for name, spec in architecture.components.items()).get(host)
    declared = load.totals() if load else {}
    taken = usage.components.values() if usage else ()
    measured = {"cpu": sum(run.cpu for run in taken), "memory": sum(run.memory for run in taken)} if usage else {}
    there = offered(architecture.rules(host))
    for name in (*there, *sorted(declared.keys() - there.keys())):
        limit = there.get(name, 0.0)
        why = _why_not_measured(name, measured, usage)
        yield AmountLine(name, UNITS.get(name, ""), limit, declared.get(name, 0.0), measured.get(name), why)


def _components(architecture: Architecture, host: str, usage: HostUsage | None) -> Iterator[ComponentNeeds]:
    for name, spec in sorted(architecture.components.items()):
        if spec.host != host:
            continue
        run = usage.components.get(name) if usage else None
        measured = {"cpu": run.cpu, "memory": run.memory} if run else {}
        declared = {**dict.fromkeys(UNITS, 0.0), **needs(spec)}
        lines = (
            NeedLine(
                amount, UNITS.get(amount, ""), need, measured.get(amount), _why_not_measured(amount, measured, usage)
            )
            for amount, need in declared.items()
        )
        yield ComponentNeeds(name, tuple(lines))


def _why_not_measured(amount: str, measured: Mapping[str, float], usage: HostUsage | None) -> str:
    if amount in measured:
        return ""
    if amount not in UNITS:
        return DECLARED_ONLY
    return NOT_ASKED if usage is None else NO_PROCESS


def _devices(architecture: Architecture, host: str) -> Iterator[DeviceLine]:
    rules = architecture.rules(host)
    scopes = architecture.scopes
    held = {
        device: name
        for name, spec in sorted(architecture.components.items())
        if spec.host == host
        for device in devices(spec, rules, scopes)
    }
    for device in dict.fromkeys((*rules.devices, *sorted(held))):
        yield DeviceLine(device, held.get(device))
