"""What really stands, asked of processes and hosts and not of the manager."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Any

from regraft import CallFailed
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.client import ClientError
from tests.support.hosts import JoinedHost
from tests.support.machine.processes import children_of
from tests.support.systems import System
from tests.support.waiting import wait_until


@dataclass(frozen=True, slots=True)
class Standing:
    """One component as it stands: its host, its class, its state, its values, and the process that it is."""

    host: str
    cls: str
    state: str
    parameters: dict[str, Any]
    connections: dict[str, str | None]
    pid: int


Standings = dict[str, Standing]


def settled(system: System, *others: JoinedHost) -> Standings:
    """Wait until every process that a host has is well, and return how each component stands."""
    found: list[Standings] = []
    hosts = {"local": system.process.pid} | {guest.name: guest.process.pid for guest in others}

    def well() -> bool:
        with contextlib.suppress(ClientError, AssertionError):
            found.append(_look(system, hosts))
            return True
        return False

    wait_until(well, "all processes to be well")
    return found[-1]


def _look(system: System, hosts: dict[str, int]) -> Standings:
    standings: Standings = {}
    for host, pid in hosts.items():
        there = _look_at_host(system, host)
        assert not standings.keys() & there.keys()
        standings |= there
        # Its host and the process that all are forked from run beside them.
        strangers = set(children_of(pid)) - {standing.pid for standing in there.values()}
        assert len(strangers) == 1, f"processes of nobody: {strangers}"
    return standings


def _look_at_host(system: System, host: str) -> Standings:
    specs = {spec.name: spec for spec in system.client.host_view(host).specs}
    status = system.client.hosts()[host].status
    assert status is not None
    assert not [process for process in status.beside if process.pid]
    assert {process.component for process in status.processes} == specs.keys()
    standings = {}
    for process in status.processes:
        name = process.component
        assert process.state is ProcessState.RUNNING
        view = system.client.view(name)
        assert view.incarnation == process.incarnation
        values = {name: _as_at_first_host(value, host) for name, value in view.parameters.items()}
        standings[name] = Standing(host, specs[name].cls, view.state.value, values, dict(view.connections), process.pid)
    return standings


def _as_at_first_host(value: Any, host: str) -> Any:
    """Return a value as it is at the first host: each host has a folder of its own for what a run writes."""
    return value.replace(f"/tests@{host}/", "/tests/") if isinstance(value, str) else value


def architecture(system: System) -> Architecture:
    """Return what should be, once the manager answers."""
    found: list[Architecture] = []

    def told() -> bool:
        with contextlib.suppress(CallFailed):
            request = ArchitectureRequest()
            found.append(system.client.call("adaptation_manager/architecture", request, Architecture, 2.0))
            return True
        return False

    wait_until(told, "the manager to answer")
    return found[-1]


def disagreements(standings: Standings, should_be: Architecture) -> list[str]:
    """Return where what stands is not what should be."""
    found = [f"{name} should not be there" for name in standings.keys() - should_be.components.keys()]
    for name, spec in should_be.components.items():
        if name not in standings:
            found.append(f"{name} should be there")
        elif spec.managed:
            found += [f"{name}: {what}" for what in _differences(standings[name], spec)]
    return found


def _differences(standing: Standing, spec: ComponentSpec) -> list[str]:
    found = []
    if standing.host != spec.host:
        found.append(f"it is on {standing.host}, should be on {spec.host}")
    if standing.cls != spec.cls:
        found.append(f"its class is {standing.cls}, should be {spec.cls}")
    if standing.state != spec.state.value:
        found.append(f"it is {standing.state}, should be {spec.state.value}")
    for name, value in spec.parameters.items():
        if standing.parameters.get(name) != value:
            found.append(f"{name} is {standing.parameters.get(name)!r}, should be {value!r}")
    wired = spec.connections if spec.state is not State.UNCONFIGURED else {}
    for port, topic in wired.items():
        if standing.connections.get(port) != topic:
            found.append(f"{port} is connected to {standing.connections.get(port)!r}, should be {topic!r}")
    return found


def delivered(system: System) -> dict[str, dict[str, dict[str, int]]]:
    """Return what has arrived at the end of each line: per line and origin."""
    snapshot = system.client.control("meter", "state")
    assert isinstance(snapshot, Snapshot)
    lines: dict[str, dict[str, dict[str, int]]] = snapshot.state
    return lines
