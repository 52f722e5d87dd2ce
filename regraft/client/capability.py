"""The capability of hosts: what each offers, what its components are declared to need, and what they take."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from regraft.bus_schema.messages.protocol.usage import HostUsage
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.capability import UNITS, devices, loads, needs, offered
from regraft.bus_schema.model.hosts.offers import HostOffer, with_offers


@dataclass(frozen=True, slots=True)
class AmountLine:
    """An amount of a host: its unit, empty where the name's documentation states it.

    ``offered`` null: no limit. ``declared`` is the sum of its components' needs. ``measured`` is what they take,
    null where that cannot be measured or was not asked for.
    """

    name: str
    unit: str
    offered: float | None
    declared: float
    measured: float | None


@dataclass(frozen=True, slots=True)
class DeviceLine:
    """A device that a host offers, and the component that holds it, null if none does."""

    name: str
    holder: str | None


@dataclass(frozen=True, slots=True)
class HostCapability:
    """The amounts and devices of one host."""

    host: str
    amounts: tuple[AmountLine, ...]
    devices: tuple[DeviceLine, ...]


def capability(
    architecture: Architecture, host: str, usage: HostUsage | None = None, offer: HostOffer | None = None
) -> HostCapability:
    """Return the capability of a host, with what was measured there and what it offers itself, if these are given."""
    architecture = with_offers(architecture, {host: offer} if offer else {})
    return HostCapability(host, tuple(_amounts(architecture, host, usage)), tuple(_devices(architecture, host)))


def _amounts(architecture: Architecture, host: str, usage: HostUsage | None) -> Iterator[AmountLine]:
    load = loads((name, spec.host, needs(spec)) for name, spec in architecture.components.items()).get(host)
    declared = load.totals() if load else {}
    taken = usage.components.values() if usage else ()
    measured = {"cpu": sum(run.cpu for run in taken), "memory": sum(run.memory for run in taken)} if usage else {}
    there = offered(architecture.rules(host))
    for name in (*there, *sorted(declared.keys() - there.keys())):
        limit = there.get(name, 0.0)
        yield AmountLine(name, UNITS.get(name, ""), limit, declared.get(name, 0.0), measured.get(name))


def _devices(architecture: Architecture, host: str) -> Iterator[DeviceLine]:
    held = {
        device: name
        for name, spec in sorted(architecture.components.items())
        if spec.host == host
        for device in devices(spec)
    }
    for device in dict.fromkeys((*architecture.rules(host).devices, *sorted(held))):
        yield DeviceLine(device, held.get(device))
