"""The decisions of the published case come out: a robot that drives with laser, camera and battery."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from tests.metacontrol.owl import ENERGY, SAFETY, iri, published_designs, write
from tests.metacontrol.reasoning.cycle import FAILED, RECOVERED, Cycle, objective

BOUNDS = {SAFETY: 0.5, ENERGY: 0.5}


@pytest.fixture
def robot(tmp_path: Path) -> Cycle:
    return Cycle(write(tmp_path, published_designs()), objective(bounds=BOUNDS))


def test_all_well_selects_normal(robot: Cycle) -> None:
    assert robot.design() == "normal"
    assert robot.design() == "normal"
    assert not robot.decision().is_change


def test_safety_measured_below_its_requirement_selects_slow(robot: Cycle) -> None:
    robot.run()
    robot.measure(SAFETY, 0.49)
    assert robot.design() == "slow"
    assert robot.analysis.objectives[iri("drive")].status is Status.IN_ERROR_NFR
    normal = next(each for each in robot.decision().assessments if each.design == iri("normal"))
    assert "safety 0.49 < 0.5" in normal.against[0].why
    assert "safety was measured to break the requirement: 0.49 < 0.5" in normal.against[1].why


def test_a_failed_laser_selects_degraded(robot: Cycle) -> None:
    robot.run()
    robot.set_components(laser_resender=FAILED)
    assert robot.design() == "degraded"


def test_a_low_battery_selects_energy_saving(robot: Cycle) -> None:
    robot.run()
    robot.set_components(battery=FAILED)
    assert robot.design() == "energy_saving"


def test_both_select_degraded_energy_save_and_recovery_leads_back(robot: Cycle) -> None:
    robot.run()
    robot.set_components(battery=FAILED, laser_resender=FAILED)
    assert robot.design() == "degraded_energy_save"
    robot.set_components(laser_resender=RECOVERED)
    assert robot.design() == "energy_saving"
    robot.set_components(battery=RECOVERED)
    assert robot.design() == "normal"


def test_without_laser_and_camera_there_is_no_design_and_a_component_is_in_error(robot: Cycle) -> None:
    robot.run()
    robot.set_components(camera=FAILED, laser_resender=FAILED)
    assert robot.design() is None
    assert robot.decision().status is Status.IN_ERROR_COMPONENT
    assert robot.design() is None, "also when nothing is grounded any more"
    assert robot.decision().status is Status.IN_ERROR_COMPONENT
    robot.set_components(laser_resender=RECOVERED)
    assert robot.design() == "normal"


def test_a_looser_bound_on_energy_selects_performance(tmp_path: Path) -> None:
    robot = Cycle(write(tmp_path, published_designs()), objective(bounds={SAFETY: 0.5, ENERGY: 0.8}))
    assert robot.design() == "performance"


def test_a_decision_is_explained_for_each_design(robot: Cycle) -> None:
    robot.set_components(battery=FAILED)
    robot.run()
    assert robot.decision().lines is not None
    assert robot.plan.text().splitlines()[:8] == [
        "drive: energy_saving (IN_PROGRESS)",
        "  normal: not selected, utility 0.76",
        "    safety: +0.16 of the utility",
        "    performance: +0.7 of the utility",
        "    energy: -0.1 of the utility",
        "    for: safety is estimated 0.8, >= 0.5",
        "    for: energy is estimated 0.5, <= 0.5",
        "    against: not realisable: battery has failed (rule required-component)",
    ]
    data = robot.decision().as_data()["designs"]
    assert isinstance(data, list)
    assert [each["selected"] for each in data if isinstance(each, dict)] == [False, False, False, True, False, False]
