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

pytestmark = pytest.mark.slow

COMMON = (
    "rounds_internal_common",
    "rounds_external_common",
    "rounds_external_context",
    "rounds_planned",
    "rounds_planned_unmonitored",
    "rounds_planned_no_lead",
    "rounds_planned_no_bearing",
    "rounds_planned_no_rate",
)


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
    for mission in ("rounds_planned", "rounds_planned_no_bearing", "rounds_planned_no_rate"):
        assert values(mission, "options") == {"camera/image;corner_camera/image | 1;3 | 1.0;3.0"}
    for mission in ("rounds_external_common", "rounds_external_context"):
        script = next(value for name, value in attributes(MISSIONS / f"{mission}.xml") if "cameras :=" in value)
        assert "'camera/image;corner_camera/image'" in script
        assert "' | 1;3 | 1.0;3.0'" in script


def entries(mission: str) -> set[str]:
    """Return what the forecast reads before a look."""
    (given,) = values(mission, "entries")
    return set(given.split(";"))


def test_each_ablation_leaves_one_part_of_the_forecast_out() -> None:
    whole = entries("rounds_planned")
    bearing = {"hydrant_x", "hydrant_y", "robot_x", "robot_y", "robot_qz", "robot_qw"}
    assert whole - entries("rounds_planned_no_bearing") == bearing
    assert whole - entries("rounds_planned_no_rate") == {"corner_rate"}
    assert whole - entries("rounds_planned_unmonitored") == {"corner_faults"}
    planned, no_lead = (
        next(value for value in values(mission, "knobs") if "navigator.power" in value)
        for mission in ("rounds_planned", "rounds_planned_no_lead")
    )
    assert " + 0.1 * navigator.max_velocity" in planned
    without_layout = [" ".join(text.split()) for text in (planned, no_lead)]
    assert without_layout[0].replace(" + 0.1 * navigator.max_velocity", "") == without_layout[1]


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


def test_the_rules_that_learn_leave_a_corner_camera_that_does_not_see_the_hydrant() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rules_learned", drives=1.0)
        rounds.senses.values["corner_faults"] = 0.0
        rounds.detector.seen_from = set()
        rig.advance(20.0)
        assert rounds.cameras == [CORNER, OWN]
        assert asked(rounds) == {"pictures": 1, "interval": 3.0}


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


def test_the_contextual_bandits_learn_to_be_slow_near_things_and_fast_elsewhere() -> None:
    with Rig() as rig:
        rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external_context", drives=400.0)
        for turn in range(8):
            nearest, best = ((NEAR, 0.17), (FAR, 0.26))[turn % 2]
            rounds.senses.values["nearest"] = nearest
            chosen = []
            for _ in range(120):
                rig.advance(0.1)
                rounds.senses.values["speed"] = rounds.speeds[-1][1] if rounds.speeds else 0.26
                chosen.append(rounds.senses.values["speed"])
        assert sum(speed == best for speed in chosen) > 100


def test_the_contextual_bandits_look_by_what_the_forecast_reads() -> None:
    with Rig() as rig:
        planner = rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external_context", drives=1.0)
        rounds.navigator.reached.append(0.0)
        rounds.detector.seen_from = {0.0, 1.0}
        rounds.senses.values |= {"corner_faults": 0.0, "robot_x": 0.0, "robot_y": 0.0, "robot_qz": 0.0, "robot_qw": 1.0}
        rig.advance(40.0)
        names = planner.snapshot()["frog/look"]["learned"]["linucb"][1]["names"]
        assert {"blocked", "dark", "rate"} <= set(names) <= {"ahead", "blocked", "dark", "rate"}


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


def test_without_the_lead_the_forecast_waits_until_something_is_near() -> None:
    with Rig() as rig:
        rig.add(ForecastPlanner, "forecast")
        rounds = Rounds(rig, "rounds_planned_no_lead", drives=60.0)
        rounds.senses.values["nearest"] = 0.48
        rig.advance(4.0)
        assert rounds.speeds == []
        rounds.senses.values["nearest"] = NEAR
        rig.advance(4.0)
        assert [speed for _, speed in rounds.speeds] == [0.17]


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
