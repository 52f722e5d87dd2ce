"""An adaptation reports which of its components it could not reach, and why."""

from __future__ import annotations

from dataclasses import replace

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import OtherHost, ProcessState, ProcessStatus
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
from regraft.bus_schema.model.lifecycle import Transition
from tests.adaptation.system import System, small_architecture
from tests.support.waiting import wait_until

NORMAL = [
    {"change": "transition", "component": "fragile", "transition": "activate"},
    {"change": "set_parameters", "component": "listener", "parameters": {"gain": 0.9}},
]


@pytest.fixture
def apart(bare_system: System) -> System:
    """A system whose fragile component is on another host, which is lost."""
    small = small_architecture()
    fragile = replace(small.components["fragile"], host="edge")
    components = {**small.components, "fragile": fragile}
    host = bare_system.host
    host.architecture = replace(small, components=components, hosts=("local", "edge"), modes={"normal": NORMAL})
    host.specs["fragile"] = fragile
    bare_system.running.pop("fragile").kill()
    del host.processes["fragile"]
    lost = ProcessStatus("fragile", 1, ProcessState.LOST, exit_reason="its host is lost")
    host.others = (OtherHost("edge", HostState.LOST, (lost,)),)
    bare_system.start_manager(answer_within=0.4)
    return bare_system


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


def test_a_component_without_a_process_is_not_running(system: System) -> None:
    system.running.pop("fragile").kill()
    system.host.ended("fragile")
    ((name, code, host, why),) = _unreached(system.adapt(ChangeState("fragile", Transition.DEACTIVATE)))
    assert (name, code, host) == ("fragile", UnreachedCode.NOT_RUNNING, "local")
    assert why.startswith("is not running: its process is stopped")


def test_where_all_answer_nothing_is_unreached(system: System) -> None:
    assert _unreached(system.adapt(SetParameters("listener", {"gain": 0.9}))) == []
