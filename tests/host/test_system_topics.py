"""The topics ``system/...`` under the real clock, in each order in which the first host hears of events."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus, Event
from regraft.bus_schema.messages.management.system import SystemFaults, SystemStates
from regraft.bus_schema.messages.protocol.host import (
    HostStatus,
    OtherHost,
    ProcessState,
    ProcessStatus,
    StartComponent,
)
from regraft.bus_schema.messages.protocol.joining import JoinHost
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import State
from regraft.host.joining.proof_checker import ProofChecker
from regraft.host.primary_host import PrimaryHost
from regraft.host.system_topics import HostSystemTopics
from regraft.runtime.core.clock import RealClock
from tests.host.processes.test_records_of_runs import AWAY, HOME, NoProcesses, ask, plan
from tests.support.waiting import wait_until

KEYS = Keys("t")
READER = ComponentSpec("reader", connections={"states": "system/states", "faults": "system/faults"})
DIED = ("component.restarted", {"incarnation": 2, "ended": "killed"})
"""The end of the first run."""


@dataclass
class Heard:
    """The topics of a first host, and all that it published."""

    bus: MemoryBus
    topics: HostSystemTopics
    runs: dict[str, int] = field(default_factory=dict)
    said: list[Any] = field(default_factory=list)

    def status(self, name: str, incarnation: int, state: State = State.ACTIVE, failure: str = "") -> None:
        self._put(KEYS.status(name), ComponentStatus(name, incarnation, state, 1, 0.0, failure=failure))

    def event(self, kind: str, details: dict[str, Any], name: str = "laser") -> None:
        self._put(KEYS.event, Event(0.0, kind, name, kind, details))

    def host(self, host: str, state: HostState) -> None:
        self._put(KEYS.host("local", "status"), HostStatus("local", 0.0, 1, (), others=(OtherHost(host, state),)))

    def _put(self, key: str, message: object) -> None:
        publisher = self.bus.publisher(key, type_of(type(message)).encoding, reliable=True)
        publisher.put(codec.encode(message), Envelope("tester", 1, 1, 1, 0).to_bytes())
        self.topics.publish()

    def news(self) -> list[tuple[str, str, str]]:
        """Return the component, kind and code of each fault that was reported as new."""
        news = [fault for said in self.said if isinstance(said, SystemFaults) for fault in said.news]
        return [(fault.component, fault.kind.value, fault.code) for fault in news]

    def last(self, cls: type) -> Any:
        return next(message for message in reversed(self.said) if isinstance(message, cls))


@pytest.fixture
def heard() -> Heard:
    hub = MemoryHub()
    runs: dict[str, int] = {}
    topics = HostSystemTopics(MemoryBus(hub), KEYS, "local", RealClock(), lambda run: run(), runs.get)
    topics.see(
        Architecture(
            "t",
            1,
            False,
            {"reader": READER, "laser": ComponentSpec("laser"), "far": ComponentSpec("far", host="edge")},
            {},
        )
    )
    made = Heard(MemoryBus(hub), topics, runs)
    for topic, cls in (("system/states", SystemStates), ("system/faults", SystemFaults)):

        def take(sample: Any, cls: type = cls) -> None:
            made.said.append(codec.decode(sample.payload, cls))

        made.bus.subscribe(KEYS.topic(topic), take)
    return made


@pytest.mark.parametrize("first", ["the end", "the next run"])
def test_a_run_that_follows_another_ends_its_fault_whichever_is_heard_of_first(heard: Heard, first: str) -> None:
    heard.status("laser", 1)
    if first == "the end":
        heard.event(*DIED)
        assert [fault.incarnation for fault in heard.last(SystemFaults).present] == [1]
        assert heard.last(SystemStates).state_of("laser") is None
    heard.status("laser", 2)
    if first != "the end":
        heard.event(*DIED)
    assert heard.last(SystemFaults).present == ()
    assert heard.last(SystemStates).state_of("laser") is State.ACTIVE
    assert [fault.kind.value for said in heard.said if isinstance(said, SystemFaults) for fault in said.news] == [
        "died",
        "recovered",
    ]


@pytest.mark.parametrize("between", [None, State.INACTIVE])
def test_every_run_that_reads_gets_the_present_state_once_it_is_active(heard: Heard, between: State | None) -> None:
    heard.event("component.failed", {})
    heard.status("reader", 1)
    heard.said.clear()
    if between is not None:
        heard.status("reader", 2, between)
    heard.status("reader", 2)
    assert [fault.component for fault in heard.last(SystemFaults).present] == ["laser"]
    assert heard.last(SystemStates).state_of("reader") is State.ACTIVE
    heard.said.clear()
    heard.status("reader", 2)
    assert heard.said == []


@pytest.mark.parametrize("number", [0, -7, False])
def test_an_event_whose_details_make_no_fault_is_left_out_and_harms_nobody(heard: Heard, number: int) -> None:
    heard.status("reader", 1)
    heard.event("component.restarted", {"incarnation": number})
    heard.event("component.failed", {"code": 100_000 * "x"})
    assert heard.last(SystemFaults).present == ()
    heard.event(*DIED)
    assert [fault.component for fault in heard.last(SystemFaults).present] == ["laser"]


@pytest.mark.parametrize("state", [HostState.LOST, HostState.LEFT])
def test_components_have_no_run_once_their_host_is_gone_until_their_next_run(heard: Heard, state: HostState) -> None:
    heard.status("laser", 1)
    heard.status("far", 1)
    heard.host("edge", HostState.SILENT)
    assert heard.last(SystemStates).state_of("far") is State.ACTIVE
    for _ in range(2):
        heard.host("edge", state)
    found = heard.last(SystemStates)
    assert (found.state_of("far"), found.state_of("laser")) == (None, State.ACTIVE)
    heard.host("edge", HostState.JOINED)
    heard.status("far", 2)
    assert heard.news() == [("far", "died", "host_gone"), ("far", "recovered", "another_run")]


def test_a_run_that_is_heard_once_its_host_is_back_has_not_died(heard: Heard) -> None:
    heard.status("far", 1)
    heard.host("edge", HostState.LOST)
    for _ in range(2):
        heard.status("far", 1)  # before its host has joined again
        heard.host("edge", HostState.LOST)
    assert heard.last(SystemStates).state_of("far") is None
    heard.host("edge", HostState.JOINED)
    assert [fault.component for fault in heard.last(SystemFaults).present] == ["far"]
    heard.status("far", 1)
    assert heard.last(SystemStates).state_of("far") is State.ACTIVE
    assert heard.last(SystemFaults).present == ()
    assert heard.news() == [("far", "died", "host_gone"), ("far", "recovered", "host_back")]


def test_a_run_that_has_failed_is_still_failed_once_its_host_is_back(heard: Heard) -> None:
    heard.status("far", 1)
    heard.host("edge", HostState.LOST)
    heard.host("edge", HostState.JOINED)
    heard.status("far", 1, State.INACTIVE, failure="it broke")
    assert [fault.component for fault in heard.last(SystemFaults).present] == ["far"]


FORGED = 2**32 - 1


def test_a_forged_run_hides_none_that_a_host_reports(heard: Heard) -> None:
    heard.runs["laser"] = 1
    heard.status("laser", 1)
    heard.status("laser", FORGED, State.FINALIZED)
    assert heard.last(SystemStates).state_of("laser") is State.FINALIZED
    heard.status("laser", 1)
    assert heard.last(SystemStates).state_of("laser") is State.ACTIVE
    heard.status("laser", 0, State.FINALIZED)
    assert heard.last(SystemStates).state_of("laser") is State.ACTIVE


def test_a_fault_during_a_forged_run_ends_with_one_that_a_host_reports(heard: Heard) -> None:
    heard.status("laser", 1)
    heard.status("laser", FORGED)
    heard.event("component.ended", {})
    heard.runs["laser"] = 2
    heard.status("laser", 2)
    assert heard.last(SystemStates).state_of("laser") is State.ACTIVE
    assert heard.last(SystemFaults).present == ()


def test_names_that_the_architecture_lacks_are_left_out(heard: Heard) -> None:
    heard.status("reader", 1)
    heard.status("ghost", 1)
    heard.event("component.failed", {}, "ghost")
    heard.event("component.failed", {})
    assert [state.component for state in heard.last(SystemStates).components] == ["reader"]
    assert [fault.component for fault in heard.last(SystemFaults).present] == ["laser"]


def test_the_first_host_believes_the_runs_of_all_hosts() -> None:
    hub, states = MemoryHub(), list[SystemStates]()
    reader = ComponentSpec("reader", host="local", connections={"states": "system/states"})
    bus, keys = MemoryBus(hub), Keys("tests")
    host = PrimaryHost(plan("local", HOME, reader, replace(AWAY, name="far")), bus, NoProcesses(), ProofChecker(None))
    ask(host, "join", JoinHost("edge", "one"))
    far = ProcessStatus("far", 3, ProcessState.RUNNING, 8, 0, 0.0, "")
    host.others.heard(HostStatus("edge", 0.0, 1, (far,)))
    ask(host, "start", StartComponent("ticker", term=1))
    host.pump(0.0)
    bus.subscribe(keys.topic("system/states"), lambda item: states.append(codec.decode(item.payload, SystemStates)))
    for name, run in (("ticker", 1), ("far", 3)):
        for incarnation, state in ((run, State.ACTIVE), (FORGED, State.FINALIZED), (run, State.ACTIVE)):
            publisher = bus.publisher(keys.status(name), type_of(ComponentStatus).encoding, reliable=True)
            status = ComponentStatus(name, incarnation, state, 1, 0.0)
            publisher.put(codec.encode(status), Envelope(name, 1, 1, 1, 0).to_bytes())

    def believed() -> bool:
        host.pump(0.0)
        return bool(states) and [states[-1].state_of(name) for name in ("ticker", "far")] == 2 * [State.ACTIVE]

    wait_until(believed, "the states of the runs")
