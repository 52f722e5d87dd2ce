"""The needs of components, and the offers of hosts: amounts, which add up, and devices, which one component holds.

Cores (``cpu``) and MiB of ``memory`` are amounts that every host has: it offers any number unless it names one. An
amount of any other name, such as ``power`` or ``accelerator_area``, is there only where a host names it. ``cpu`` and
``memory`` are needed as long as a process runs, other amounts and devices while a component is configured.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, HostRules
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.bus_schema.suggestions import instead_of

UNITS = {"cpu": "cores", "memory": "MiB"}
"""The amounts that every host has, and their units."""
ROUNDING = 1e-9
"""The part of an offer by which a sum of floats may exceed it."""
NAMED = 5
"""The greatest number of components that a problem names."""

Needs = dict[str, float]
"""How much is needed of each amount."""


def needs(spec: ComponentSpec) -> Needs:
    """Return the amounts that a component needs in the state that it is to have."""
    if spec.description is None or spec.state is State.FINALIZED:
        return {}
    resources = spec.description.resources
    found = {"cpu": float(resources.cpu), "memory": float(resources.memory)}
    return found | resources.amounts if is_configured(spec) else found


def is_configured(spec: ComponentSpec) -> bool:
    """Return whether a component is to hold its devices and named amounts."""
    return spec.state not in (State.UNCONFIGURED, State.FINALIZED)


def devices(spec: ComponentSpec, rules: HostRules, scopes: Collection[str]) -> tuple[str, ...]:
    """Return the devices that a component is to hold of its host, by name, in a system with these scopes.

    A component of one robot among several holds the robot's own, such as ``rescuer/dock``, where its host has that.
    """
    if spec.description is None or not is_configured(spec):
        return ()
    scope = scope_of(spec.name, scopes)
    own = {device: f"{scope}/{device}" if scope else device for device in spec.description.resources.devices}
    return tuple(sorted({own[device] if own[device] in rules.devices else device for device in own}))


def offer(rules: HostRules, amount: str) -> float | None:
    """Return how much a host offers of an amount, None without a limit."""
    if amount == "cpu":
        return rules.cpu
    return rules.memory if amount == "memory" else rules.amounts.get(amount, 0.0)


def offered(rules: HostRules) -> dict[str, float | None]:
    """Return all amounts that a host offers, None for those without a limit."""
    return {amount: offer(rules, amount) for amount in (*UNITS, *sorted(rules.amounts))}


@dataclass(frozen=True, slots=True)
class Load:
    """The needs at one host, by who has them."""

    host: str
    of: Mapping[str, Needs]

    def totals(self) -> Needs:
        """Return the sum of each amount."""
        found: Needs = defaultdict(float)
        for each in self.of.values():
            for amount, value in each.items():
                found[amount] += value
        return dict(found)

    def excess(self, rules: HostRules) -> Iterator[tuple[str, float, float]]:
        """Yield each amount of which more is needed than is offered: its name, the offer, the total."""
        for amount, total in sorted(self.totals().items()):
            limit = offer(rules, amount)
            if limit is not None and total > limit * (1.0 + ROUNDING):
                yield amount, limit, total

    def most(self, amount: str) -> str:
        """Return who needs most of an amount, with how much."""
        shares = {who: each[amount] for who, each in self.of.items() if each.get(amount)}
        greatest = sorted(shares, key=lambda who: (-shares[who], who))[:NAMED]
        return ", ".join(f"{who} {shares[who]:g}" for who in greatest)


def loads(runs: Iterable[tuple[str, str, Needs]]) -> dict[str, Load]:
    """Return the load of each host, from who needs how much at which host."""
    found: dict[str, dict[str, Needs]] = defaultdict(dict)
    for who, host, of in runs:
        found[host][who] = of
    return {host: Load(host, of) for host, of in found.items()}


def measured_in(amount: str) -> str:
    """Return an amount's unit, or its name where the name states what it is."""
    return UNITS.get(amount, amount)


def capability_violations(architecture: Architecture) -> Iterator[Violation]:
    """Yield every host that offers too little, and every device that is not there or held twice."""
    specs = sorted((name, spec) for name, spec in architecture.components.items() if spec.host in architecture.hosts)
    for host, load in sorted(loads((name, spec.host, needs(spec)) for name, spec in specs).items()):
        rules = architecture.rules(host)
        for amount, limit, total in load.excess(rules):
            if limit == 0.0 and amount not in offered(rules):
                yield from _missing(architecture, load, amount)
                continue
            place = f"hosts.{host}.{amount}" if amount in UNITS else f"hosts.{host}.amounts.{amount}"
            problem = f"offers {limit:g} {measured_in(amount)}, but its components need {total:g} ({load.most(amount)})"
            yield Violation(None, "", place, f"{problem}: place some of them elsewhere")
    yield from _devices(architecture, specs)


def _missing(architecture: Architecture, load: Load, amount: str) -> Iterator[Violation]:
    host = load.host
    hint = _hint(amount, architecture.rules(host).amounts, f"hosts.{host}.amounts")
    others = _elsewhere(name for name in architecture.hosts if amount in architecture.rules(name).amounts)
    for name, of in load.of.items():
        if of.get(amount):
            problem = f"needs {of[amount]:g} {amount}, and host {host!r} offers none: {hint}{others}"
            yield Violation(None, name, f"resources.amounts.{amount}", problem)


def _devices(architecture: Architecture, specs: Iterable[tuple[str, ComponentSpec]]) -> Iterator[Violation]:
    held: dict[tuple[str, str], list[str]] = defaultdict(list)
    scopes = architecture.scopes
    for name, spec in specs:
        for device in devices(spec, architecture.rules(spec.host), scopes):
            held[spec.host, device].append(name)
    for (host, device), holders in sorted(held.items()):
        there = architecture.rules(host).devices
        hint = _hint(device, there, f"hosts.{host}.devices")
        others = _elsewhere(each for each in architecture.hosts if device in architecture.rules(each).devices)
        for name in holders:
            if device not in there:
                problem = f"needs {device} for itself, and host {host!r} has none: {hint}{others}"
                yield Violation(None, name, "resources.devices", problem)
            elif len(holders) > 1:
                rest = ", ".join(repr(other) for other in holders if other != name)
                problem = (
                    f"needs {device} of host {host!r} for itself, but {rest} holds it: "
                    f"move one to another host, or leave it unconfigured{_alone(architecture, name, host, device)}"
                )
                yield Violation(None, name, "resources.devices", problem)


def _alone(architecture: Architecture, name: str, host: str, device: str) -> str:
    scope = scope_of(name, architecture.scopes)
    shared = scope and not device.startswith(f"{scope}/")
    return f", or name {scope}/{device} under hosts.{host}.devices" if shared else ""


def _hint(name: str, there: Iterable[str], place: str) -> str:
    known = tuple(there)
    if not known:
        return f"name it under {place}"
    return f"name it under {place}; {instead_of(name, known)}"


def _elsewhere(hosts: Iterable[str]) -> str:
    names = ", ".join(hosts)
    return f"; offered by: {names}" if names else ""
