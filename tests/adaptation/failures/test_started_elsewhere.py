"""A component of a lost host that cannot be started elsewhere stays a component of its host."""

from __future__ import annotations

from dataclasses import replace

from regraft.bus_schema.messages.protocol.host import OtherHost, ProcessState, ProcessStatus
from regraft.bus_schema.model.adaptation import Move, Outcome
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.adaptation.system import System, small_architecture


def test_a_start_elsewhere_that_fails_leaves_the_component_to_its_host(bare_system: System) -> None:
    small = small_architecture()
    fragile = replace(small.components["fragile"], host="edge", parameters={"mood": "fails"})
    host = bare_system.host
    host.architecture = replace(small, components={**small.components, "fragile": fragile}, hosts=("local", "edge"))
    host.specs["fragile"] = fragile
    bare_system.running.pop("fragile").kill()
    del host.processes["fragile"]
    lost = ProcessStatus("fragile", 1, ProcessState.LOST, exit_reason="its host is lost")
    host.others = (OtherHost("edge", HostState.LOST, (lost,)),)
    bare_system.ends_are_seen = True
    bare_system.start_manager(answer_within=0.5, undo_within=1.0)
    report = bare_system.adapt(Move("fragile", "local"))
    assert report.outcome is Outcome.ROLLED_BACK, report.error
    assert "cannot be activated in this mood" in report.error
    assert host.architecture.components["fragile"].host == "edge"
    assert not host.processes["fragile"].pid
