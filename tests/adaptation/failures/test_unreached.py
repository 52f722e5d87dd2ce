"""An adaptation reports which of its components it could not reach, and why."""

from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryQuery
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.host import HostStatus, OtherHost, ProcessState, ProcessStatus, UpdateSpecs
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
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
from tests.adaptation.parts import Fragile
from tests.adaptation.system import SYSTEM, System, small_architecture
from tests.support.waiting import PATIENCE, wait_until

NORMAL = [
    {"change": "transition", "component": "fragile", "transition": "activate"},
    {"change": "set_parameters", "component": "listener", "parameters": {"gain": 0.9}},
]


def _place_on_edge(system: System, name: str = "fragile") -> None:
    """Place a component on another host."""
    small = small_architecture()
    placed = replace(small.components[name], host="edge")
    components = {**small.components, name: placed}
    host = system.host
    host.architecture = replace(small, components=components, hosts=("local", "edge"), modes={"normal": NORMAL})
    host.specs[name] = placed
    del host.processes[name]


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
    """The host of a component that gets a ``later`` value.

    As it gets the former specs its link is cut, and that is seen at once. If it ``takes_former``, that is so at the
    next question.
    """

    def __init__(
        self,
        system: System,
        name: str = "fragile",
        later: tuple[str, PlainValue] = ("level", 2),
        takes_former: bool = False,
    ) -> None:
        self.is_cut = False
        self.started_again = False
        self._takes_former = takes_former
        self._has_former = False
        self._system = system
        self._later = later
        self._process = ProcessStatus(name, 1, ProcessState.RUNNING, pid=1)
        self.is_seen(HostState.JOINED)
        bus, keys = MemoryBus(system.hub), Keys(SYSTEM)
        bus.serve(keys.host("edge", "specs"), self._specs)
        bus.serve(keys.host("edge", "stop"), self._stop)
        bus.serve(keys.host("edge", "start"), self._start)

    def is_seen(self, state: HostState) -> None:
        """Have the first host report it so."""
        joined = state is HostState.JOINED
        process = self._process if joined or not self._takes_former else replace(self._process, state=ProcessState.LOST)
        self._system.host.others = (OtherHost("edge", state, (process,)),)

    def heal(self) -> None:
        """Answer again, without having to join again."""
        self.is_cut = False
        self.is_seen(HostState.JOINED)

    def _specs(self, query: MemoryQuery) -> None:
        update = codec.decode(query.payload, UpdateSpecs)
        is_former = any(self._later not in spec.parameters.items() for spec in update.specs)
        if (is_former and not self._takes_former) or (self._has_former and not update.specs):
            self._has_former = False
            self.is_cut = True
            self.is_seen(HostState.SILENT)
        elif is_former:
            self._has_former = True
        if not self.is_cut:
            self._answer(query)

    def _stop(self, query: MemoryQuery) -> None:
        self._process = replace(self._process, state=ProcessState.STOPPED, pid=0)
        self._answer(query)

    def _start(self, query: MemoryQuery) -> None:
        self.started_again = True
        self._answer(query)

    def _answer(self, query: MemoryQuery) -> None:
        query.reply(codec.encode(HostStatus("edge", 0.0, 1, (self._process,), term=self._system.host.term)))


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


def test_a_host_that_falls_silent_before_its_step_is_undone_is_known_to_have_missed_that(bare_system: System) -> None:
    _place_on_edge(bare_system)
    edge = Edge(bare_system, takes_former=True)
    bare_system.start_manager(answer_within=0.4)
    line = bare_system.adapt(SetParameters("fragile", {"level": 2}), confirm=60.0, wait=False)
    wait_until(lambda: bare_system.lines(id=line.id).entries[0].outcome is Outcome.CONFIRMING)
    report = bare_system.cancel(line.id)
    assert edge.is_cut
    assert report.outcome is Outcome.CANCELLED, report.error
    assert [(each.component, each.code) for each in report.unreached] == [("fragile", UnreachedCode.HOST_SILENT)]
    last = bare_system.host.updates[-1]
    assert last.not_told == ("edge",)
    assert [spec.parameters.get("level", 0) for spec in last.specs] == [0]


def test_a_component_whose_host_answers_again_before_the_undo_ends_begins_again(bare_system: System) -> None:
    _place_on_edge(bare_system, "listener")
    edge = Edge(bare_system, "listener", ("label", "fancy"), takes_former=True)
    bare_system.start_manager()
    assert bare_system.adapt(SetParameters("fragile", {"mood": "hangs"})).outcome is Outcome.APPLIED
    far, slow = SetParameters("listener", {"label": "fancy"}), SetParameters("fragile", {"mood": "well", "level": 2})
    request = AdaptationRequest((slow, far), confirm=60.0, wait=False)
    line = bare_system.client.call("adaptation_manager/adapt", request, AdaptationReport)
    wait_until(lambda: bare_system.lines(id=line.id).entries[0].outcome is Outcome.CONFIRMING)
    cancelling = threading.Thread(target=bare_system.cancel, args=(line.id,))
    cancelling.start()
    wait_until(lambda: bare_system.running["fragile"].component.level == 0, "the other step to be undone")
    assert edge.is_cut
    edge.heal()
    Fragile.release.set()
    cancelling.join(PATIENCE)
    assert edge.started_again


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
