"""A host keeps nothing of ended runs that keeps a component from being started, or that grows."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.host import (
    LetSpeak,
    StartComponent,
    StartSuccessor,
    StopComponent,
    UpdateSpecs,
)
from regraft.bus_schema.messages.protocol.joining import JoinedSystem
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.hosts.offers import NO_OFFER
from regraft.host.host import Host
from regraft.host.joined_host import JoinedHost
from regraft.host.plan import HostPlan
from regraft.host.zygote.zygote import Zygote
from regraft.runtime.core.lease import now
from regraft.security.host_proof import Seal
from tests.support.waiting import wait_until

HOME = ComponentSpec("ticker", cls="tests.host.parts:Ticker", host="local")
AWAY = replace(HOME, host="edge")


class NoProcesses(Zygote):
    """Starts nothing: the test reports what became of a process."""

    def __init__(self) -> None:
        self.pid = 1
        self.orders: list[tuple[str, int]] = []

    def spawn(
        self, assignment: Mapping[str, Any], folder: str, log: str, command: list[str] | None, files: int | None = None
    ) -> None:
        self.orders.append((assignment["name"], assignment["incarnation"]))

    def signal(self, pid: int, signum: int) -> None:
        pass


def plan(name: str, *components: ComponentSpec) -> HostPlan:
    specs = {spec.name: spec for spec in components}
    architecture = Architecture("tests", 1, False, specs, {}, ("local", "edge"))
    return HostPlan(
        name=name,
        architecture=architecture,
        folder=Path("/run"),
        stack_folder=Path("/stack"),
        run="run",
        endpoint="tcp/127.0.0.1:1",
        secret="secret",
    )


def ask(host: Host, verb: str, message: object) -> None:
    host.questions.verbs[verb](codec.encode(message))


def started(host: Host, name: str, incarnation: int, pid: int = 7) -> None:
    host.zygote_reports({"started": pid, "name": name, "incarnation": incarnation})


def ended(host: Host, name: str, incarnation: int, pid: int = 7) -> None:
    host.zygote_reports({"ended": pid, "name": name, "incarnation": incarnation, "code": 1})


def awaiting_a_successor(zygote: NoProcesses) -> Host:
    """Return a host whose component runs, and is to be succeeded on another host."""
    local = Host(plan("local", HOME), MemoryBus(MemoryHub()), zygote)
    ask(local, "start", StartComponent("ticker", term=1))
    local.start_due()
    started(local, "ticker", 1)
    local.beats(local.processes["ticker"])
    ask(local, "succeed", StartSuccessor(AWAY, 1, True, 1))
    return local


@pytest.fixture
def zygote() -> NoProcesses:
    return NoProcesses()


def test_a_component_can_be_started_where_its_successor_had_ended(zygote: NoProcesses) -> None:
    edge = Host(plan("edge", HOME), MemoryBus(MemoryHub()), zygote)
    ask(edge, "succeed", StartSuccessor(AWAY, 1, True, 1, 2))
    started(edge, "ticker", 2)
    ended(edge, "ticker", 2)
    ask(edge, "specs", UpdateSpecs(2, (AWAY,), term=1))
    ask(edge, "start", StartComponent("ticker", term=1))
    edge.start_due()
    assert zygote.orders == [("ticker", 2), ("ticker", 3)]


def test_a_component_can_be_started_where_its_frozen_run_had_ended(zygote: NoProcesses) -> None:
    local = awaiting_a_successor(zygote)
    ask(local, "speak", LetSpeak("ticker", 2, None, 1, "edge"))
    ended(local, "ticker", 1)
    ask(local, "specs", UpdateSpecs(1, (HOME,), term=1))
    ask(local, "start", StartComponent("ticker", term=1))
    local.start_due()
    assert [name for name, _ in zygote.orders] == ["ticker", "ticker"]
    assert zygote.orders[1][1] > zygote.orders[0][1]


def test_a_run_that_ended_while_its_successor_was_awaited_is_started_once(zygote: NoProcesses) -> None:
    local = awaiting_a_successor(zygote)
    ended(local, "ticker", 1)
    ask(local, "specs", UpdateSpecs(1, (HOME,), term=1))
    ask(local, "start", StartComponent("ticker", term=1))
    local.start_due()
    started(local, *zygote.orders[-1], pid=8)
    for _ in range(3):
        local.start_due()
    assert len(zygote.orders) == 2


def joined_host(wanted: HostPlan, hub: MemoryHub, zygote: NoProcesses, lease: float) -> JoinedHost:
    """Return a host that has just joined."""
    return JoinedHost(wanted, MemoryBus(hub), zygote, system(wanted, lease), now(), "one", Seal(), NO_OFFER)


def system(wanted: HostPlan, lease: float) -> JoinedSystem:
    """Return what the first host answers to one that joins."""
    return JoinedSystem("run", 1, 1, wanted.architecture, 0, "", "/run", "/stack", lease)


@pytest.mark.parametrize(("placed", "removals"), [((HOME,), []), ((), ["ticker"])])
def test_a_host_that_is_back_reports_only_what_is_in_the_architecture_no_more_as_removed(
    zygote: NoProcesses, placed: tuple[ComponentSpec, ...], removals: list[str]
) -> None:
    hub, keys, events = MemoryHub(), Keys("tests"), list[Event]()
    first = MemoryBus(hub)
    edge = joined_host(plan("edge", AWAY), hub, zygote, 0.0)
    ask(edge, "start", StartComponent("ticker", term=1))
    edge.start_due()
    started(edge, "ticker", 1)
    first.subscribe(keys.event, lambda item: events.append(codec.decode(item.payload, Event)))

    def answer(item: Any) -> None:
        query = first.open_query(item)
        assert query is not None
        query.reply(codec.encode(system(plan("edge", *placed), 60.0)))

    first.serve(keys.host("local", "join"), answer)

    def is_told() -> bool:
        edge.pump(0.0)
        return edge.processes["ticker"].stopping

    wait_until(is_told, "the answer to its joining")
    ended(edge, "ticker", 1)
    assert "ticker" not in edge.processes
    assert "host.returned" in [event.kind for event in events]
    assert [event.subject for event in events if event.kind == "component.removed"] == removals


def test_a_joined_host_keeps_no_lease_of_what_was_removed(zygote: NoProcesses) -> None:
    edge = joined_host(plan("edge"), MemoryHub(), zygote, 60.0)
    files = os.listdir("/proc/self/fd")
    for number in range(1, 21):
        name = f"ticker_{number}"
        ask(edge, "specs", UpdateSpecs(number, (replace(AWAY, name=name),), term=1))
        ask(edge, "start", StartComponent(name, term=1))
        edge.start_due()
        started(edge, name, 1)
        ask(edge, "specs", UpdateSpecs(number, removed=(name,), term=1))
        ask(edge, "stop", StopComponent(name, 0.0, 1))
        ended(edge, name, 1)
        edge.pump(0.0)
    assert len(zygote.orders) == 20
    assert len(os.listdir("/proc/self/fd")) <= len(files)
