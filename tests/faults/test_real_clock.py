"""Under the real clock, faults come by the seconds since the start, and are read by the same inputs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest

from regraft import CallFailed
from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.messages.management.system import SystemFaultKind, SystemFaults, SystemStates
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.model.adaptation import JOURNAL
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.client import Client
from tests.faults.parts import Sample
from tests.faults.stacks import UNDER_THE_REAL_CLOCK, write
from tests.support.commands import run
from tests.support.machine.processes import kill
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

KILL = "  - {at: 2.0, component: driver, kind: kill}\n"
READERS = ("adaptation_manager", "decider", "summary")
"""The components that read faults."""


@dataclass
class Heard:
    """All that is heard of the system from its start."""

    faults: list[SystemFaults] = field(default_factory=list)
    states: list[SystemStates] = field(default_factory=list)
    decided: list[Sample] = field(default_factory=list)

    def listen(self, client: Client) -> None:
        """Hear it."""
        client.topic("decided", Sample, lambda sample: self.decided.append(sample.message))
        client.topic("system/faults", SystemFaults, lambda sample: self.faults.append(sample.message))
        client.topic("system/states", SystemStates, lambda sample: self.states.append(sample.message))


@pytest.fixture(scope="module")
def heard() -> Heard:
    return Heard()


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory, heard: Heard) -> Iterator[System]:
    """The system under the real clock, in which the driver is killed."""
    folder = tmp_path_factory.mktemp("faults")
    with home(folder / "home"), all_ended() as started:
        started.append(System(write(folder, UNDER_THE_REAL_CLOCK, KILL)))
        heard.listen(started[0].client)
        yield started[0]


def test_a_scheduled_kill_is_decided_upon_as_in_simulated_time(system: System, heard: Heard) -> None:
    wait_until(lambda: system.said("fault.injected", "driver"), "the kill")
    seen = [SystemFaultKind.DIED, SystemFaultKind.RECOVERED]
    wait_until(lambda: _kinds(heard.faults)[:2] == seen, "the end and the return")
    wait_until(lambda: len(heard.decided) == 2, "two decisions")
    assert [(sample.source, sample.value > 0) for sample in heard.decided] == [("died", True), ("recovered", True)]
    wait_until(lambda: heard.states[-1].state_of("spare") is State.INACTIVE, "the spare one to rest again")
    assert heard.states[-1].state_of("driver") is State.ACTIVE
    without_news = [faults for faults in heard.faults if not faults.news]
    assert len(without_news) <= len(READERS), "only a new reader is sent what is present, and no heartbeat is a reason"


def test_the_journal_has_lines_of_a_failure_and_its_end(system: System) -> None:
    def lines() -> list[SystemFaultKind]:
        page = system.client.call(JOURNAL, JournalRequest(), JournalPage, PATIENCE)
        return [fault.kind for fault in page.faults if fault.component == "driver"]

    wait_until(lambda: len(lines()) == 2, "two lines")
    assert lines() == [SystemFaultKind.RECOVERED, SystemFaultKind.DIED]
    wait_until(lambda: "recovered" in _listed(), "the lines to be listed")
    assert "driver ended: killed by SIGKILL" in _listed()


def test_a_component_has_no_fault_that_is_not_on_the_schedule(system: System) -> None:
    wait_until(lambda: system.said("component.transition", "spare"), "the spare one")
    bus = open_bus(system.info.hub)
    try:
        hang = codec.encode(ScheduledFault(3.0, "spare", FaultKind.HANG))
        (answer,) = bus.query(system.client.keys.control("spare", 1, "fault"), hang, PATIENCE)
    finally:
        bus.close()
    assert answer.error
    assert codec.decode(answer.payload, ControlError).code is ControlCode.REFUSED
    assert system.client.view("spare").component == "spare"


def test_the_journal_keeps_its_lines_when_the_manager_is_killed(system: System) -> None:
    def kinds() -> list[SystemFaultKind]:
        try:
            page = system.client.call(JOURNAL, JournalRequest(), JournalPage, 1.0)
        except CallFailed:
            return []
        return [fault.kind for fault in page.faults]

    wait_until(lambda: len(kinds()) == 2, "two lines")
    kill(system.wait_running("adaptation_manager").pid)
    system.wait_running("adaptation_manager", 2)
    wait_until(lambda: kinds()[-2:] == [SystemFaultKind.RECOVERED, SystemFaultKind.DIED], "the same lines again")


def _listed() -> str:
    return run("journal").stdout


def _kinds(told: list[SystemFaults]) -> list[SystemFaultKind]:
    return [fault.kind for faults in told for fault in faults.news if fault.component == "driver"]
