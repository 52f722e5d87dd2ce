"""``regraft host --resources``: what hosts offer, what their components are declared to need, and what they take."""

from __future__ import annotations

import time
from dataclasses import asdict

from regraft.bus_schema.messages.protocol.usage import HostUsage
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.cli.running_system import Reached
from regraft.cli.terminal.output import show_json, show_table
from regraft.client.capability import AmountLine, HostCapability, capability
from regraft.client.errors import ClientError

MEASURED_FOR = 0.6
"""Seconds for which processor time is measured."""


def show_resources(there: Reached, as_json: bool) -> None:
    """Print the capability of every host."""
    architecture = there.client.host_view(LOCAL).architecture
    seen = there.client.hosts()
    hosts = dict.fromkeys((*architecture.hosts, *seen))
    _measured(there, hosts)
    time.sleep(MEASURED_FOR)
    measured = _measured(there, hosts)
    offers = {host: seen[host].offer for host in hosts if host in seen}
    found = [capability(architecture, host, measured.get(host), offers.get(host)) for host in hosts]
    if as_json:
        show_json({"hosts": [asdict(one) for one in found]})
        return
    rows = [row for one in found for row in _rows(one)]
    show_table(("host", "resource", "unit", "offered", "declared", "measured"), rows, empty="no hosts")


def _measured(there: Reached, hosts: dict[str, None]) -> dict[str, HostUsage]:
    """Return what was measured where there is an answer."""
    found = {}
    for host in hosts:
        try:
            found[host] = there.client.usage(host)
        except ClientError:
            continue
    return found


def _rows(one: HostCapability) -> list[tuple[object, ...]]:
    amounts: list[tuple[object, ...]] = [
        (one.host, line.name, line.unit, _offered(line), f"{line.declared:.4g}", _shown(line.measured))
        for line in one.amounts
    ]
    return amounts + [(one.host, line.name, "device", 1, line.holder or "", "") for line in one.devices]


def _offered(line: AmountLine) -> str:
    return "no limit" if line.offered is None else f"{line.offered:.4g}"


def _shown(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
