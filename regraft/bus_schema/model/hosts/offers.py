"""The offers that a host makes itself as it joins: they add to what the stack names for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Final

from regraft.bus_schema.annotations import Bounds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture, HostRules
from regraft.bus_schema.model.description import Amounts, check_amounts, check_devices
from regraft.bus_schema.model.hosts.capability import Load, devices, measured_in, needs, offered


@message("regraft/HostOffer")
@dataclass(frozen=True, slots=True)
class HostOffer:
    """A host's own offer: ``cpu`` (cores) and ``memory`` (MiB), None without a limit, other amounts, and devices."""

    cpu: Annotated[float, Bounds(0.0)] | None = None
    memory: Annotated[float, Bounds(0.0)] | None = None
    devices: tuple[str, ...] = ()
    amounts: Amounts = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self != HostOffer()

    def text(self) -> str:
        """Return it as one line, equal for equal offers."""
        known = {"cpu": self.cpu, "memory": self.memory, **self.amounts}
        parts = [f"{name}={value!r}" for name, value in sorted(known.items()) if value is not None]
        return " ".join((*parts, *sorted(self.devices)))


NO_OFFER: Final = HostOffer()


def with_offer(rules: HostRules, offer: HostOffer) -> HostRules:
    """Return the rules of a host with what it offers itself."""
    return replace(
        rules,
        cpu=rules.cpu if offer.cpu is None else offer.cpu,
        memory=rules.memory if offer.memory is None else offer.memory,
        devices=tuple(dict.fromkeys((*rules.devices, *offer.devices))),
        amounts={**rules.amounts, **offer.amounts},
    )


def with_offers(architecture: Architecture, offers: Mapping[str, HostOffer]) -> Architecture:
    """Return an architecture with what hosts offer themselves."""
    changed = {host: with_offer(architecture.rules(host), offer) for host, offer in offers.items() if offer}
    return replace(architecture, host_rules={**architecture.host_rules, **changed}) if changed else architecture


def offer_problems(architecture: Architecture, host: str, offer: HostOffer) -> Iterator[str]:
    """Yield why a host cannot join with an offer: it is none, the stack has it already, or components need more."""
    try:
        check_amounts(offer.amounts)
        check_devices(offer.devices)
    except BadMessage as error:
        yield f"offer.{error}"
        return
    rules = architecture.rules(host)
    there = {name: value for name, value in offered(rules).items() if value is not None}
    for name, value in {"cpu": offer.cpu, "memory": offer.memory, **offer.amounts}.items():
        if value is not None and name in there:
            yield f"offer.{name}: the stack names {there[name]:g} for host {host!r} already: leave it out here or there"
    for device in offer.devices:
        if device in rules.devices:
            yield f"offer.{device}: the stack names this device for host {host!r} already: leave it out here or there"
    yield from _lacking(architecture, host, with_offer(rules, offer))


def _lacking(architecture: Architecture, host: str, rules: HostRules) -> Iterator[str]:
    """Yield what the components that are placed on a host need of it, and it does not offer."""
    placed = {name: spec for name, spec in sorted(architecture.components.items()) if spec.host == host}
    load = Load(host, {name: needs(spec) for name, spec in placed.items()})
    for name, limit, total in load.excess(rules):
        needed = f"its components need {total:g} ({load.most(name)})"
        yield f"offer.{name}: host {host!r} offers {limit:g} {measured_in(name)}, but {needed}: offer {name}={total:g}"
    scopes = architecture.scopes
    for name, spec in placed.items():
        for device in devices(spec, rules, scopes):
            if device not in rules.devices:
                yield f"offer.{device}: {name} on host {host!r} needs this device: offer it"
