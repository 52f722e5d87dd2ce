"""The arms of FROG's study decide as they are described, with the options that all of them have."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.model.adaptation import SetParameters
from regraft.stacks.frog.studies.arms.arms import ARMS
from regraft.stacks.frog.utility import driving_reward
from regraft.testing import Rig
from tests.missions.acting import CORNER, OWN
from tests.missions.robot import MISSIONS, darkness
from tests.missions.test_rounds import FAR, NEAR, Rounds

COMMON = ("rounds_internal_common", "rounds_external_common", "rounds_planned", "rounds_planned_unmonitored")


def attributes(file: Path) -> Iterator[tuple[str, str]]:
    """Yield the attributes of all nodes of a mission and of what it includes."""
    for node in ElementTree.parse(file).iter():
        yield from node.attrib.items()
        if node.tag == "include":
            yield from attributes(file.parent / node.attrib["path"])


def values(mission: str, *names: str) -> set[str]:
    """Return the literal values of some attributes in a mission."""
    found = {value for name, value in attributes(MISSIONS / f"{mission}.xml") if name in names}
    return {value for value in found if not value.startswith("{")}


@pytest.mark.parametrize("mission", COMMON)
def test_all_strategies_choose_among_the_same_speeds_at_the_same_interval(mission: str) -> None:
    options = values(mission, "speeds", "adaptation_options")
    assert {option for option in options if "|" not in option} == {"0.10;0.17;0.26"}
    assert values(mission, "adaptation_period", "period") == {"250ms"}


def test_all_strategies_choose_among_the_same_ways_to_look() -> None:
    (planned,) = values("rounds_planned", "options")
    script = next(value for name, value in attributes(MISSIONS / "rounds_external_common.xml") if "cameras :=" in value)
    assert planned == "camera/image;corner_camera/image | 1;3 | 1.0;3.0"
    assert "'camera/image;corner_camera/image'" in script
    assert "' | 1;3 | 1.0;3.0'" in script


def test_every_arm_has_a_mission_and_a_name_of_its_own() -> None:
    assert len({arm.name for arm in ARMS}) == len(ARMS)
    assert all((MISSIONS / f"{arm.mission}.xml").is_file() for arm in ARMS)


def asked(rounds: Rounds) -> dict[str, object]:
    """Return what the detector's parameters were set to last."""
    changes = [change for change in rounds.manager.changes if isinstance(change, SetParameters)]
    return {
        name: value for change in changes if change.component == "detector" for name, value in change.parameters.items()
    }


def test_by_the_rules_the_robot_is_slow_near_things_and_fast_elsewhere() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rules", drives=60.0)
        rounds.senses.values |= {"nearest": NEAR, "corner_faults": 0.0}
        rig.advance(3.0)
        rounds.senses.values["nearest"] = 0.48
        rig.advance(3.0)
        assert [speed for _, speed in rounds.speeds] == [0.17]
        rounds.senses.values["nearest"] = FAR
        rig.advance(3.0)
        assert [speed for _, speed in rounds.speeds] == [0.17, 0.26]


def test_by_the_rules_the_robot_looks_for_itself_while_the_corner_camera_is_faulty_and_the_budget_lasts() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rules", drives=1.0)
        rounds.senses.values["corner_faults"] = 0.0
        rig.advance(5.0)
        assert rounds.cameras == [CORNER]
        assert asked(rounds)["pictures"] == 3
        rounds.senses.values["corner_faults"] = 1.0
        rig.advance(5.0)
        assert rounds.cameras == [CORNER, OWN]
        assert asked(rounds) == {"pictures": 1, "interval": 3.0}
        rig.advance(120.0)
        assert rounds.cameras == [CORNER, OWN, CORNER]
        assert 0.0 <= rounds.board["energy_left"] < 59.275


def test_the_internal_plan_goes_from_speed_to_speed_of_those_that_all_have() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal_common", drives=60.0)
        rounds.senses.values |= {"nearest": NEAR, "motion_power": 0.5, "corner_faults": 0.0}
        rig.advance(4.0)
        assert [speed for _, speed in rounds.speeds] == [0.17, 0.1]
        rounds.senses.values["nearest"] = FAR
        rig.advance(4.0)
        assert [speed for _, speed in rounds.speeds] == [0.17, 0.1, 0.17, 0.26]


@pytest.mark.parametrize("faults", [0.0, 1.0])
def test_when_the_budget_is_short_the_internal_plan_leaves_a_faulty_corner_camera_alone(faults: float) -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal_common")
        rounds.senses.values["corner_faults"] = faults
        darkness(rig, 0.9)
        rig.advance(1.0)
        while rounds.board["energy_left"] > 700.0:
            rig.advance(0.5)
        rig.advance(2.0)
        assert rounds.cameras == ([] if faults else [CORNER])
        assert asked(rounds) == ({"pictures": 1, "interval": 3.0} if faults else {"pictures": 1})


def test_the_bandits_try_every_speed_and_learn_the_utility() -> None:
    with Rig() as rig:
        planner = rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external_common", drives=60.0)
        rig.advance(20.0)
        assert {speed for _, speed in rounds.speeds} == {0.1, 0.17, 0.26}
        learned = planner.snapshot()["frog/max_velocity"]["learned"]["ucb_tuned"][1]
        assert [mean for _, mean, _ in learned.values()] == [pytest.approx(driving_reward(FAR, 0.26), rel=1e-3)] * 3


def test_the_bandits_learn_what_each_way_to_look_is_worth() -> None:
    with Rig() as rig:
        planner = rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external_common", drives=1.0)
        rounds.navigator.reached.append(0.0)
        rounds.detector.seen_from = {0.0, 1.0}
        rig.advance(40.0)
        learned = planner.snapshot()["frog/look"]["learned"]["ucb_tuned"][1]
        assert len(learned) == 8
        assert {mean for _, mean, _ in learned.values()} == {1.0}


def test_a_look_that_fails_is_worth_nothing_to_the_bandits() -> None:
    with Rig() as rig:
        planner = rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external_common", drives=1.0)
        rounds.navigator.reached.append(0.0)
        rounds.detector.seen_from = {0.0, 1.0}
        rounds.detector.failures = 1
        rig.advance(40.0)
        learned = planner.snapshot()["frog/look"]["learned"]["ucb_tuned"][1]
        assert min(mean for _, mean, _ in learned.values()) < 1.0


@pytest.mark.parametrize(("mission", "notices"), [("rounds_planned", True), ("rounds_planned_unmonitored", False)])
def test_without_its_monitor_the_forecast_keeps_to_a_faulty_camera(mission: str, notices: bool) -> None:
    with Rig() as rig:
        rig.add(ForecastPlanner, "forecast")
        rounds = Rounds(rig, mission, drives=1.0)
        rounds.navigator.reached.append(0.0)
        rounds.detector.seen_from = {0.0, 1.0}
        rounds.senses.values["corner_faults"] = 1.0
        rig.advance(20.0)
        assert (rounds.cameras == []) is notices


def test_with_single_pictures_the_forecast_chooses_the_camera_alone() -> None:
    with Rig() as rig:
        rig.add(ForecastPlanner, "forecast")
        rounds = Rounds(rig, "rounds_planned_single", drives=1.0)
        rounds.senses.values["corner_faults"] = 0.0
        rig.advance(20.0)
        assert rounds.cameras[0] == CORNER
        assert set(rounds.detector.asked) == {1}


@pytest.mark.parametrize(("mission", "interval"), [("rounds_planned", 0.25), ("rounds_planned_3s", 3.0)])
def test_the_forecast_decides_at_its_interval(mission: str, interval: float) -> None:
    with Rig() as rig:
        rig.add(ForecastPlanner, "forecast")
        rounds = Rounds(rig, mission, drives=60.0)
        rounds.senses.values["nearest"] = NEAR
        rig.advance(8.0)
        ((at, speed),) = rounds.speeds
        assert speed == 0.17
        assert interval <= at <= interval + 0.5
