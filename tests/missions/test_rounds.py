"""FROG's rounds: what the robot does, what it changes for its requirements' sake, and what it survives."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import Connect, Outcome, SetParameters
from regraft.services.bt_executor.executor import Executor
from regraft.services.detector.detector import Detector as RealDetector
from regraft.services.sensor_monitor import SensorMonitor
from regraft.stacks.frog.utility import driving_reward
from regraft.testing import Rig
from tests.executor.helpers import status
from tests.executor.robot import goals
from tests.missions.acting import CORNER, OWN, ActingManager, PlainCamera, Senses
from tests.missions.robot import MISSIONS, NODES, Detector, Navigator, darkness

pytestmark = pytest.mark.slow

NEAR, FAR = 0.3, 2.0
"""Metres: within the first tenth of the lidar's range, and well beyond."""
START = 0.1
"""Seconds: the executor's first tick, at which a round begins."""
FATES: list[Outcome | str] = [Outcome.REJECTED, Outcome.ROLLED_BACK, Outcome.STUCK, "silent"]


class Rounds:
    """A robot that makes its rounds among some goals, with a manager that acts."""

    def __init__(
        self, rig: Rig, mission: str, main: str = "", drives: float = 5.0, places: int = 2, cameras: bool = False
    ) -> None:
        self.rig = rig
        self.navigator = rig.add(Navigator, parameters={"seconds": drives})
        self.manager = rig.add(ActingManager, "adaptation_manager")
        self.manager.manage(rig, "rounds")
        self.senses = rig.add(Senses, "system_reflection")
        self.senses.manager = self.manager
        if cameras:
            rig.add(PlainCamera, "camera", connections={"image": OWN})
            rig.add(PlainCamera, "corner_camera", connections={"image": CORNER})
            rig.add(RealDetector, "detector", {"interval": 1.0}, {"image": OWN})
            rig.add(SensorMonitor, None, {"expected": ("image",), "frozen_after": 1.0}, {"image": OWN})
        else:
            self.detector = rig.add(Detector)
            self.detector.navigator = self.navigator
            self.detector.is_on_board = lambda: self.manager.looks_through(OWN)
        self.looks = rig.collect("detections", Detections)
        file = str(MISSIONS / f"{mission}.xml")
        rig.add(Executor, "bt_executor", {"mission": file, "main": main, "nodes": NODES})
        darkness(rig, 0.0)
        rig.publish("goals", goals(*"abcd"[:places]))

    @property
    def state(self) -> MissionState:
        return status(self.rig).state

    @property
    def board(self) -> dict[str, Any]:
        return status(self.rig).blackboard

    @property
    def speeds(self) -> list[tuple[float, float]]:
        """How long after the start which maximum velocity was asked for and given."""
        given = [report for report in self.manager.reports if report.outcome is Outcome.APPLIED]
        return [
            (round(report.started - START, 1), change.parameters["max_velocity"])
            for report in given
            for change in report.request.changes
            if isinstance(change, SetParameters) and "max_velocity" in change.parameters
        ]

    @property
    def cameras(self) -> list[str]:
        """The topics that the detector was connected to, one after the other."""
        return [str(change.topic) for change in self.manager.changes if isinstance(change, Connect)]

    def quality(self, name: str) -> Quality:
        (found,) = [quality for quality in status(self.rig).qualities if quality.requirement == name]
        return found

    def told(self, kind: str) -> list[str]:
        return [event.text for event in self.rig.events if event.kind == kind]

    def fail(self, camera: str, failure: str) -> None:
        self.rig.runtimes[camera].parameters.set({"failure": failure})


# --- the round ---


@pytest.mark.parametrize("mission", ["rounds_baseline", "rounds_internal", "rounds_rewired"])
def test_a_round_visits_every_goal_and_looks_five_times_on_each_leg(mission: str) -> None:
    with Rig() as rig:
        rounds = Rounds(rig, mission, "OneRound", places=3)
        rig.advance(30.0)
        assert rounds.state is MissionState.SUCCEEDED, status(rig).error
        assert rounds.navigator.reached == [0.0, 1.0, 2.0]
        assert len(rounds.detector.asked) == 15
        assert rounds.board["looks_left"] == 0


def test_rounds_follow_each_other() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_baseline")
        rig.advance(32.0)
        assert rounds.navigator.reached == [0.0, 1.0] * 3
        assert rounds.state is MissionState.RUNNING
        assert rounds.manager.reports == []


def test_a_goal_that_is_never_reached_and_a_look_that_never_succeeds_are_told_and_left_out() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal", "OneRound")
        rounds.navigator.blocked = {0.0}
        rounds.detector.failures = 3
        rig.advance(40.0)
        assert rounds.told("mission.goal_missed") == ["did not get to a: the way is blocked"]
        assert rounds.told("mission.trouble") == ["cannot look: detect: no picture came"]
        assert rounds.navigator.reached == [1.0]
        assert rounds.state is MissionState.SUCCEEDED


def test_all_five_requirements_are_told_while_a_leg_is_under_way() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_baseline")
        rig.advance(4.0)
        told = {quality.requirement: quality for quality in status(rig).qualities}
        assert list(told) == [
            "MoveSafely", "MoveQuickly", "MovePowerEfficiently", "DetectPowerEfficiently", "DetectEffectively",
        ]  # fmt: skip
        assert told["MoveQuickly"].metric == 1.0
        assert told["MovePowerEfficiently"].metric == pytest.approx(6.63 * told["MovePowerEfficiently"].stamp, rel=0.1)
        assert told["DetectEffectively"].satisfied is False
        rounds.senses.values["nearest"] = NEAR
        rig.advance(0.5)
        assert rounds.quality("MoveSafely").satisfied is False
        rounds.senses.values["speed"] = 0.1
        rig.advance(0.5)
        assert rounds.quality("MoveSafely").satisfied is True


# --- the speed plan ---


def test_the_speed_goes_down_step_by_step_near_obstacles_and_up_again_away_from_them() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal", drives=60.0)
        rounds.senses.values |= {"nearest": NEAR, "motion_power": 0.5}
        rig.advance(13.0)
        assert rounds.speeds == [(3.0, 0.18), (6.0, 0.1)]
        rounds.senses.values["nearest"] = FAR
        rig.advance(9.0)
        assert rounds.speeds[2:] == [(15.0, 0.18), (18.0, 0.26)]
        assert rounds.navigator.max_velocity == 0.26


def test_a_leg_that_costs_much_is_driven_more_slowly_and_the_next_one_fast_again() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal", drives=20.0)
        rig.advance(20.5)
        # 80 J are what 12.1 s take at 6.63 W.
        assert rounds.speeds == [(15.0, 0.18), (18.0, 0.1)]
        rig.advance(8.0)
        assert [speed for _, speed in rounds.speeds[2:]] == [0.18, 0.26]


def test_where_nothing_is_to_be_changed_nobody_is_asked() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal", drives=11.0)
        rig.advance(11.0)
        assert rounds.manager.reports == []
        assert rounds.board["pictures_outcome"] == "unchanged"


def test_without_a_reflection_the_speed_is_left_alone_and_the_requirements_are_unknown() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal")
        rig.runtimes.pop("system_reflection").leave()
        rig.advance(25.0)
        assert rounds.speeds == []
        assert rounds.manager.reports == []
        assert {quality.status for quality in status(rig).qualities if quality.requirement.startswith("Move")} == {
            "unknown"
        }
        assert len(rounds.navigator.reached) >= 4


# --- the picture plan ---


def test_three_pictures_are_taken_in_the_dark_and_one_in_the_light() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal", drives=10.0)
        darkness(rig, 0.71)
        rig.advance(9.0)
        assert rounds.detector.asked == [3, 3, 3, 3, 3]
        darkness(rig, 0.70)
        rig.advance(9.0)
        assert rounds.detector.asked[-4:] == [1, 1, 1, 1]
        assert rounds.cameras == []


def test_in_the_dark_the_other_camera_takes_over_before_the_budget_is_gone_and_hands_back_in_the_light() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_internal")
        darkness(rig, 0.9)
        rig.advance(45.0)
        assert rounds.cameras == [CORNER]
        left = rounds.board["energy_left"]
        assert 0.0 < left < 12 * 59.275 + 3 * 59.275
        assert rounds.detector.asked[-1] == 1
        rig.advance(10.0)
        assert rounds.board["energy_left"] == left
        darkness(rig, 0.1)
        rig.advance(30.0)
        assert rounds.cameras == [CORNER, OWN, CORNER]
        assert rounds.board["energy_left"] == pytest.approx(0.0, abs=1e-6)
        assert rounds.quality("DetectPowerEfficiently").satisfied is True


def test_without_a_plan_the_budget_is_overdrawn_and_that_is_told() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_baseline")
        rig.runtimes["detector"].parameters.set({"pictures": 5})
        rig.advance(40.0)
        assert rounds.quality("DetectPowerEfficiently").satisfied is False
        assert rounds.cameras == []


# --- the rewired camera ---


@pytest.mark.parametrize("failure", ["black", "frozen", "silent"])
def test_when_its_camera_fails_the_robot_looks_through_the_other_one_until_it_is_well_again(failure: str) -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rewired", cameras=True)
        rig.advance(6.0)
        assert rounds.cameras == []
        assert {look.camera for look in rounds.looks} == {"camera"}
        rounds.fail("camera", failure)
        rig.advance(20.0)
        assert rounds.cameras[0] == CORNER
        assert rounds.cameras[-1] == CORNER
        assert rounds.looks[-1].camera == "corner_camera"
        seen = len(rounds.looks)
        rig.advance(5.0)
        assert len(rounds.looks) > seen
        assert not rounds.told("mission.trouble")
        rounds.fail("camera", "none")
        rig.advance(8.0)
        assert rounds.cameras[-1] == OWN
        assert rounds.looks[-1].camera == "camera"


def test_a_camera_that_fails_costs_the_rounds_no_look() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rewired", "OneRound", cameras=True)
        rounds.fail("camera", "black")
        rig.advance(40.0)
        assert rounds.state is MissionState.SUCCEEDED
        assert rounds.board["looks_left"] == 0
        assert len([look for look in rounds.looks if look.camera == "corner_camera"]) == 10
        assert len([look for look in rounds.looks if look.camera == "camera"]) == 1


def test_where_both_cameras_fail_that_is_told_and_the_rounds_go_on() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rewired", cameras=True)
        rounds.fail("camera", "black")
        rounds.fail("corner_camera", "black")
        rig.advance(60.0)
        assert "none was of use" in rounds.told("mission.trouble")[0]
        assert len(rounds.navigator.reached) >= 2
        assert rounds.state is MissionState.RUNNING


def test_without_the_sensor_monitor_the_other_camera_is_kept() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_rewired", cameras=True)
        rounds.fail("camera", "black")
        rig.advance(6.0)
        rig.runtimes.pop("sensormonitor").leave()
        rounds.fail("camera", "none")
        rig.advance(20.0)
        assert rounds.cameras == [CORNER]


# --- the external strategy ---


def test_the_strategy_tries_every_speed_and_is_told_what_each_was_worth() -> None:
    with Rig() as rig:
        planner = rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external", drives=60.0)
        rig.advance(40.0)
        assert {speed for _, speed in rounds.speeds} == {0.1, 0.18, 0.26}
        assert all(at % 3.0 == 0.0 for at, _ in rounds.speeds)
        learned = planner.snapshot()["frog/max_velocity"]["learned"]["ucb_tuned"][1]
        worth = driving_reward(FAR, 0.26)
        assert [mean for _, mean, _ in learned.values()] == [pytest.approx(worth, rel=1e-3)] * 3


def test_a_speed_at_which_the_robot_is_not_safe_is_worth_nothing() -> None:
    with Rig() as rig:
        planner = rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, "rounds_external", drives=60.0)
        rounds.senses.values["nearest"] = NEAR
        rig.advance(20.0)
        learned = planner.snapshot()["frog/max_velocity"]["learned"]["ucb_tuned"][1]
        assert {mean for _, mean, _ in learned.values()} == {0.0}


def test_without_the_planner_the_rounds_go_on() -> None:
    with Rig() as rig:
        rounds = Rounds(rig, "rounds_external")
        rig.advance(40.0)
        assert rounds.board["speed_outcome"] == "no_answer"
        assert len(rounds.navigator.reached) >= 4
        assert rounds.state is MissionState.RUNNING


# --- adaptations that come to nothing ---


@pytest.mark.parametrize(
    ("mission", "fate"),
    [
        *(("rounds_internal", fate) for fate in FATES),
        ("rounds_external", Outcome.REJECTED),
        ("rounds_external", "silent"),
        ("rounds_rewired", Outcome.STUCK),
        ("rounds_rewired", "silent"),
        *(
            pytest.param(mission, fate, marks=pytest.mark.evidence)
            for mission in ("rounds_external", "rounds_rewired")
            for fate in FATES
        ),
    ],
    ids=lambda part: getattr(part, "value", part),
)
def test_an_adaptation_that_comes_to_nothing_ends_no_mission(mission: str, fate: Outcome | str) -> None:
    with Rig() as rig:
        if mission == "rounds_external":
            rig.add(BanditPlanner, "bandits")
        rounds = Rounds(rig, mission, cameras=mission == "rounds_rewired", places=3)
        rounds.senses.values["nearest"] = NEAR
        rounds.manager.fates = [fate] * 1000
        darkness(rig, 0.9)
        if mission == "rounds_rewired":
            rounds.fail("camera", "silent")
        rig.advance(50.0 if mission == "rounds_rewired" else 20.0)
        assert len(rounds.manager.fates) < 1000
        assert rounds.manager.changes == []
        assert rounds.navigator.reached
        assert rounds.state is MissionState.RUNNING
