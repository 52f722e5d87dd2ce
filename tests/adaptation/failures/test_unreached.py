"""An adaptation reports which of its components it could not reach, and why."""

from __future__ import annotations

from dataclasses import replace

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryQuery
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.host import HostStatus, OtherHost, ProcessState, ProcessStatus, UpdateSpecs
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    ChangeState,
    EnterMode,
    Outcome,
    Remove,
    SetParameters,
    Unreached,
    UnreachedCode,
)
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.adaptation.system import SYSTEM, System, small_architecture
from tests.support.waiting import wait_until

NORMAL = [
    {"change": "transition", "component": "fragile", "transition": "activate"},
    {"change": "set_parameters", "component": "listener", "parameters": {"gain": 0.9}},
]


def _place_on_edge(system: System) -> None:
    """Place the fragile component on another host."""
    small = small_architecture()
    fragile = replace(small.components["fragile"], host="edge")
    components = {**small.components, "fragile": fragile}
    host = system.host
    host.architecture = replace(small, components=components, hosts=("local", "edge"), modes={"normal": NORMAL})
    host.specs["fragile"] = fragile
    del host.processes["fragile"]


@pytest.fixture
def apart(bare_system: System) -> System:
    """A system whose fragile component is on another host, which is lost."""
    _place_on_edge(bare_system)
    host = bare_system.host
    bare_system.running.pop("fragile").kill()
    lost = ProcessStatus("fragile", 1, ProcessState.LOST, exit_reason="its host is lost")
    host.others = (OtherHost("edge", HostState.LOST, (lost,)),)
    bare_system.start_manager(answer_within=0.4)
    return bare_system


class Edge:
    """The host of the fragile component. As it gets the former specs its link is cut, and that is seen at once."""

    def __init__(self, system: System) -> None:
        self.is_cut = False
        self._system = system
        self._process = ProcessStatus("fragile", 1, ProcessState.RUNNING, pid=1)
        self.is_seen(HostState.JOINED)
        MemoryBus(system.hub).serve(Keys(SYSTEM).host("edge", "specs"), self._specs)

    def is_seen(self, state: HostState) -> None:
        """Have the first host report it so."""
        self._system.host.others = (OtherHost("edge", state, (self._process,)),)

    def _specs(self, query: MemoryQuery) -> None:
        update = codec.decode(query.payload, UpdateSpecs)
        if any(spec.parameters.get("level") != 2 for spec in update.specs):
            self.is_cut = True
            self.is_seen(HostState.SILENT)
        if not self.is_cut:
            query.reply(codec.encode(HostStatus("edge", 0.0, 1, (self._process,), term=update.term or 0)))


def _unreached(report: AdaptationReport) -> list[tuple[str, UnreachedCode, str, str]]:
    assert report.outcome is Outcome.APPLIED, report
    return [(each.component, each.code, each.host, each.why) for each in report.unreached]


def test_a_mode_is_applied_and_reports_components_of_lost_hosts(apart: System) -> None:
    lost = ("fragile", UnreachedCode.HOST_LOST, "edge", "its host 'edge' is lost")
    report = apart.adapt(EnterMode("normal"))
    assert _unreached(report) == [lost]
    assert apart.view("listener").parameters["gain"] == 0.9
    assert _unreached(apart.lines(id=report.id).entries[0]) == [lost], "the journal has it"
    wait_until(lambda: any(event.kind == "adaptation.applied" for event in apart.events))
    (event,) = [event for event in apart.events if event.kind == "adaptation.applied"]
    assert [codec.from_plain(each, Unreached) for each in event.details["unreached"]] == [Unreached(*lost)]


def test_what_is_only_to_do_less_is_reported_too_and_what_is_removed_is_not(apart: System) -> None:
    for change in (ChangeState("fragile", Transition.DEACTIVATE), SetParameters("fragile", {"level": 2})):
        assert [each[:2] for each in _unreached(apart.adapt(change))] == [("fragile", UnreachedCode.HOST_LOST)]
    assert _unreached(apart.adapt(Remove("fragile"))) == []


def test_what_is_only_to_do_less_may_be_on_a_host_that_has_not_joined(apart: System) -> None:
    waits = ProcessStatus("fragile", 0, ProcessState.WAITING, exit_reason="its host has not joined")
    apart.host.others = (OtherHost("edge", HostState.ABSENT, (waits,)),)
    absent = [("fragile", UnreachedCode.HOST_ABSENT, "edge", "its host 'edge' has not joined")]
    for change in (ChangeState("fragile", Transition.DEACTIVATE), SetParameters("fragile", {"level": 2})):
        assert _unreached(apart.adapt(change)) == absent
    report = apart.adapt(ChangeState("fragile", Transition.ACTIVATE))
    assert report.outcome is Outcome.REJECTED
    assert [each.field for each in report.violations] == ["status"]


def test_a_component_without_a_process_is_not_running(system: System) -> None:
    system.running.pop("fragile").kill()
    system.host.ended("fragile")
    ((name, code, host, why),) = _unreached(system.adapt(ChangeState("fragile", Transition.DEACTIVATE)))
    assert (name, code, host) == ("fragile", UnreachedCode.NOT_RUNNING, "local")
    assert why.startswith("is not running: its process is stopped")


def test_where_all_answer_nothing_is_unreached(system: System) -> None:
    assert _unreached(system.adapt(SetParameters("listener", {"gain": 0.9}))) == []


def test_a_host_that_falls_silent_under_an_undo_leaves_nothing_stuck_however_short_the_bound(
    bare_system: System,
) -> None:
    _place_on_edge(bare_system)
    edge = Edge(bare_system)
    bare_system.start_manager(answer_within=0.4, undo_within=0.05)
    line = bare_system.adapt(SetParameters("fragile", {"level": 2}), confirm=60.0, wait=False)
    wait_until(lambda: bare_system.lines(id=line.id).entries[0].outcome is Outcome.CONFIRMING)
    report = bare_system.cancel(line.id)
    assert edge.is_cut
    assert report.outcome is Outcome.CANCELLED, report.error


@pytest.mark.parametrize("end", [ProcessState.STOPPED, ProcessState.WAITING])
@pytest.mark.parametrize("interrupted", [False, True])
def test_a_component_that_comes_back_while_a_change_is_confirmed_is_as_before_once_that_is_undone(
    system: System, interrupted: bool, end: ProcessState
) -> None:
    system.running.pop("fragile").kill()
    system.host.ended("fragile", end)
    lower = (SetParameters("fragile", {"level": 2}), ChangeState("fragile", Transition.DEACTIVATE))
    line = system.adapt(*lower, confirm=60.0, wait=False)
    wait_until(lambda: system.lines(id=line.id).entries[0].outcome is Outcome.CONFIRMING)
    assert [each.component for each in system.lines(id=line.id).entries[0].unreached] == ["fragile"]
    system.start("fragile", 2)
    assert system.view("fragile").parameters["level"] == 2
    if interrupted:
        system.running["manager"].kill()
        system.start_manager()
        report = system.lines(id=line.id).entries[0]
    else:
        report = system.cancel(line.id)
    assert report.outcome is (Outcome.ROLLED_BACK if interrupted else Outcome.CANCELLED), report.error
    wait_until(lambda: system.host.processes["fragile"].started_as == 3, "its next run")
    wait_until(lambda: system.view("fragile").state is State.ACTIVE, "it to be as before")
    assert system.view("fragile").parameters["level"] == 0
