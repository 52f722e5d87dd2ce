"""Under the real clock, faults come by the seconds since the start, and are read by the same inputs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus_schema.messages.system import SystemFaultKind, SystemFaults, SystemStates
from regraft.bus_schema.model.lifecycle import State
from tests.faults.parts import Sample
from tests.faults.stacks import UNDER_THE_REAL_CLOCK, write
from tests.support.systems import System
from tests.support.waiting import wait_until

KILL = "  - {at: 2.0, component: driver, kind: kill}\n"


@pytest.fixture
def system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[System]:
    """The system under the real clock, in which the driver is killed."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    made = System(write(tmp_path, UNDER_THE_REAL_CLOCK, KILL))
    yield made
    made.end()


def test_a_scheduled_kill_is_decided_upon_as_in_simulated_time(system: System) -> None:
    told: list[SystemFaults] = []
    states: list[SystemStates] = []
    decided: list[Sample] = []
    system.client.topic("decided", Sample, lambda sample: decided.append(sample.message))
    system.client.topic("system/faults", SystemFaults, lambda sample: told.append(sample.message))
    system.client.topic("system/states", SystemStates, lambda sample: states.append(sample.message))
    wait_until(lambda: system.said("fault.injected", "driver"), "the kill")
    wait_until(lambda: _kinds(told)[:2] == [SystemFaultKind.DIED, SystemFaultKind.RECOVERED], "the end and the return")
    wait_until(lambda: len(decided) == 2, "two decisions")
    assert [(sample.source, sample.value > 0) for sample in decided] == [("died", True), ("recovered", True)]
    wait_until(lambda: states[-1].state_of("spare") is State.INACTIVE, "the spare one to rest again")
    assert states[-1].state_of("driver") is State.ACTIVE


def _kinds(told: list[SystemFaults]) -> list[SystemFaultKind]:
    return [fault.kind for faults in told for fault in faults.news if fault.component == "driver"]
