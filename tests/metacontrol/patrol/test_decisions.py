"""The published decisions, by processes that fail, die and recover."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.objectives import ObjectiveState
from tests.metacontrol.patrol.running import OBJECTIVE, Patrol
from tests.support.machine.processes import kill
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow


def test_failures_and_recoveries_lead_to_the_published_realizations(patrol: Patrol) -> None:
    assert patrol.add().realization == "normal"
    patrol.wait_for_realization("normal")
    patrol.put(laser_resender=False)
    patrol.wait_for_realization("degraded")
    patrol.put(battery=False)
    patrol.wait_for_realization("degraded_energy_save")
    patrol.put(laser_resender=True)
    patrol.wait_for_realization("energy_saving")
    patrol.put(battery=True)
    patrol.wait_for_realization("normal")


def test_without_laser_and_camera_the_components_rest_until_one_is_back(patrol: Patrol) -> None:
    patrol.add()
    patrol.put(laser_resender=False)
    patrol.wait_for_realization("degraded")
    patrol.put(camera=False)
    patrol.wait_for_realization("")
    status = patrol.status()
    assert status is not None
    assert status.state is ObjectiveState.IN_ERROR_COMPONENT
    patrol.put(camera=True)
    patrol.wait_for_realization("degraded")
    patrol.put(laser_resender=True)
    patrol.wait_for_realization("normal")


def test_a_killed_process_is_a_failure_until_it_is_back(patrol: Patrol) -> None:
    patrol.add()
    patrol.wait_for_realization("normal")
    kill(patrol.wait_running("laser_resender").pid)
    wait_until(lambda: patrol.processes()["laser_resender"].incarnation > 1, "the next run of the laser")
    patrol.wait_for_realization("normal")


def test_what_a_process_provided_that_ends_for_good_is_provided_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    patrol = Patrol(tmp_path, for_good="battery")
    try:
        patrol.add()
        patrol.wait_for_realization("normal")
        kill(patrol.wait_running("battery").pid)
        patrol.wait_for_realization("energy_saving")
    finally:
        patrol.end()


def test_less_safety_than_is_required_leads_to_the_slow_realization(patrol: Patrol) -> None:
    patrol.add()
    patrol.measure(safety=0.6, energy=0.4)
    patrol.wait_for_realization("normal")
    patrol.measure(safety=0.4, energy=0.4)
    patrol.wait_for_realization("slow")


def test_where_more_energy_is_allowed_the_fast_realization_is_chosen(patrol: Patrol) -> None:
    assert patrol.add(replace(OBJECTIVE, requirements={"energy": 0.8})).realization == "performance"
    patrol.wait_for_realization("performance")
