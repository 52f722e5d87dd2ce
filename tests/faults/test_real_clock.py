"""Under the real clock, faults come by the seconds since the start, and are read by the same inputs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

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
from tests.faults.parts import Sample
from tests.faults.stacks import UNDER_THE_REAL_CLOCK, write
from tests.support.commands import run
from tests.support.machine.processes import kill
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, SECONDS, wait_for, wait_until

KILL = "  - {{at: {}, component: driver, kind: kill}}\n"
KILL_AT = (2.0, 10.0, PATIENCE)
READERS = ("adaptation_manager", "decider", "summary")
"""The components that read faults."""


class Heard(System):
    """The system under the real clock, in which the driver is killed; all is heard of it."""

    def __init__(self, folder: Path, kill_at: float) -> None:
        """Start it; the driver is killed ``kill_at`` seconds later."""
        self.kill_at = kill_at
        self._began = time.monotonic()
        super().__init__(write(folder, UNDER_THE_REAL_CLOCK, KILL.format(kill_at)))
        self.faults: list[SystemFaults] = []
        self.states: list[SystemStates] = []
        self.decided: list[Sample] = []
        self.client.topic("decided", Sample, lambda sample: self.decided.append(sample.message))
        self.client.topic("system/faults", SystemFaults, lambda sample: self.faults.append(sample.message))
        self.client.topic("system/states", SystemStates, lambda sample: self.states.append(sample.message))

    def is_up_in_time(self) -> bool:
        """Wait until all is up that takes part; return whether the kill is still to come."""
        wait_until(lambda: self._active() >= {"driver", *READERS}, "all to be up")
        return time.monotonic() - self._began < self.kill_at

    def _active(self) -> set[str]:
        return {name for name, seen in self.client.components().items() if seen.state is State.ACTIVE}


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Heard]:
    """The system in which the driver is killed: later each time, until all is up by then."""
    folder = tmp_path_factory.mktemp("faults")
    with home(folder / "home"):
        for kill_at in KILL_AT:
            with all_ended() as started:
                started.append(Heard(folder, kill_at))
                if started[0].is_up_in_time():
                    yield started[0]
                    return
    pytest.fail("the system was not up before any of the kills")


def test_a_scheduled_kill_is_decided_upon_as_in_simulated_time(system: Heard) -> None:
    wait_until(lambda: system.said("fault.injected", "driver"), "the kill", system.kill_at + SECONDS)
    seen = [SystemFaultKind.DIED, SystemFaultKind.RECOVERED]
    wait_until(lambda: _kinds(system.faults)[:2] == seen, "the end and the return")
    wait_until(lambda: len(system.decided) == 2, "two decisions")
    assert [(sample.source, sample.value > 0) for sample in system.decided] == [("died", True), ("recovered", True)]
    states = system.states
    wait_until(lambda: states and states[-1].state_of("spare") is State.INACTIVE, "the spare one to rest again")
    assert states[-1].state_of("driver") is State.ACTIVE
    without_news = [faults for faults in system.faults if not faults.news]
    assert len(without_news) <= len(READERS), "only a new reader is sent what is present, and no heartbeat is a reason"


def test_the_journal_has_lines_of_a_failure_and_its_end(system: Heard) -> None:
    def lines() -> list[SystemFaultKind]:
        page = system.client.call(JOURNAL, JournalRequest(), JournalPage, PATIENCE)
        return [fault.kind for fault in page.faults if fault.component == "driver"]

    wait_until(lambda: len(lines()) == 2, "two lines")
    assert lines() == [SystemFaultKind.RECOVERED, SystemFaultKind.DIED]
    listed = wait_for(lambda: text if "recovered" in (text := _listed()) else None, "the lines to be listed")
    assert "driver ended: killed by SIGKILL" in listed


def test_a_component_has_no_fault_that_is_not_on_the_schedule(system: Heard) -> None:
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


def test_the_journal_keeps_its_lines_when_the_manager_is_killed(system: Heard) -> None:
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
