"""A real stack, in processes of its own: what is reflected is rewired, goes stale, and survives restarts."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.mission import MissionRequest, MissionStatus
from regraft.bus_schema.messages.reflection import ReflectedEntries
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Change,
    Connect,
    Outcome,
    SetParameters,
)
from tests.support.machine.processes import kill
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow


def board(system: System) -> dict[str, PlainValue]:
    """Return the mission's root blackboard."""
    return system.client.call("mission/status", MissionRequest(), MissionStatus).blackboard


def wait_for_entry(system: System, key: str, value: Any) -> None:
    """Wait until an entry has a value."""
    wait_until(lambda: board(system).get(key) == value, f"{key} = {value!r}")


def adapt(system: System, *changes: Change) -> AdaptationReport:
    """Ask for an adaptation."""
    request = AdaptationRequest(changes)
    return system.client.call("adaptation_manager/adapt", request, AdaptationReport, 20.0)


def kill_running(system: System, name: str) -> None:
    """Kill a component's process."""
    kill(system.wait_running(name).pid)


def test_an_entry_is_rewired_like_any_input_and_only_to_what_it_can_read(system: System) -> None:
    wait_for_entry(system, "speed", 0.2)
    report = adapt(system, Connect("system_reflection", "speed", "other_odometry"))
    assert report.outcome is Outcome.APPLIED, report
    wait_for_entry(system, "speed", 0.5)
    assert system.client.view("system_reflection").connections["speed"] == "other_odometry"

    refused = adapt(system, Connect("system_reflection", "speed", "light"))
    assert refused.outcome is Outcome.REJECTED
    (violation,) = refused.violations
    assert (violation.change, violation.component, violation.field) == (0, "system_reflection", "connect.speed")
    assert violation.problem == (
        "input 'speed' cannot read topic 'light': LightLevel has no field 'twist'; it has: stamp, darkness"
    )
    refused = adapt(system, SetParameters("system_reflection", {"mapping": []}))
    assert [violation.problem for violation in refused.violations] == ["is read-only, set when the component starts"]

    kill_running(system, "system_reflection")
    system.wait_running("system_reflection", 2)
    wait_until(lambda: system.client.view("system_reflection").connections.get("speed") == "other_odometry")
    report = adapt(system, Connect("system_reflection", "speed", "odometry"))
    assert report.outcome is Outcome.APPLIED, report
    wait_for_entry(system, "speed", 0.2)


def test_a_dead_source_is_seen_as_stale_and_its_last_value_survives_restarts(system: System) -> None:
    reflected: list[ReflectedEntries] = []
    system.client.topic("reflection", ReflectedEntries, lambda sample: reflected.append(sample.message))
    wait_for_entry(system, "charge_stale", False)
    kill_running(system, "battery")
    wait_for_entry(system, "charge_stale", True)
    last = board(system)
    assert float(last["charge_age"]) >= 0.5
    assert last["charge"] == next(e.value for e in reflected[-1].entries if e.key == "charge")

    kill_running(system, "system_reflection")
    system.wait_running("system_reflection", 2)
    wait_until(lambda: reflected[-1].entries[1].stamp is None, "a reflection that has not heard the battery")
    assert board(system)["charge"] == last["charge"]
    assert float(board(system)["charge_age"]) > float(last["charge_age"])

    wait_until(lambda: system.client.view("bt_executor").connections["reflection"] == "reflection")
    checkpoints = last["charge_age"] + 1.0
    wait_until(lambda: float(board(system)["charge_age"]) > checkpoints, "a checkpoint to be taken")
    before = board(system)
    kill_running(system, "bt_executor")
    system.wait_running("bt_executor", 2)
    wait_until(lambda: "charge_age" in board(system), "the mission to be back")
    assert board(system)["charge"] == last["charge"]
    wait_until(lambda: float(board(system)["charge_age"]) > float(before["charge_age"]), "the age to go on")
    assert board(system)["charge_stale"] is True
