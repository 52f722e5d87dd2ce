"""FROG's missions do what they say, whatever its parts do."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.model.adaptation import ChangeState
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import kinds, status
from tests.executor.robot import goals
from tests.missions.robot import (
    MISSIONS,
    NODES,
    Detector,
    Docking,
    Explorer,
    Manager,
    Mapper,
    Navigator,
    darkness,
    power,
    sensors,
)


class Crew:
    """All parts of the robot, and its mission."""

    def __init__(self, rig: Rig, mission: str, frontiers: int = 3) -> None:
        self.rig = rig
        self.navigator = rig.add(Navigator)
        self.explorer = rig.add(Explorer, parameters={"count": frontiers})
        self.docking = rig.add(Docking)
        self.detector = rig.add(Detector)
        self.detector.navigator = self.navigator
        self.manager = rig.add(Manager)
        rig.add(Mapper)
        rig.add(Executor, "bt_executor", {"mission": str(MISSIONS / f"{mission}.xml"), "nodes": NODES})
        power(rig, 1.0)
        darkness(rig, 0.0)

    def told(self, kind: str) -> list[str]:
        return [event.text for event in self.rig.events if event.kind == kind]

    def requirement(self, name: str) -> bool | None:
        """Return whether a requirement is satisfied, as the mission's status has it."""
        (quality,) = [quality for quality in status(self.rig).qualities if quality.requirement == name]
        return quality.satisfied

    @property
    def state(self) -> MissionState:
        return status(self.rig).state


@pytest.mark.parametrize("name", ["explore", "visit", "search", "search_external"])
def test_every_mission_can_be_loaded_and_starts(name: str) -> None:
    with Rig() as rig:
        assert Crew(rig, name).state is MissionState.RUNNING


def test_exploring_goes_from_frontier_to_frontier_and_ends_at_home_with_a_full_battery() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        rig.advance(40.0)
        assert crew.navigator.reached == [1.0, 2.0, 3.0]
        assert crew.explorer.asked == [False] * 4
        assert crew.docking.until == [0.98]
        assert crew.state is MissionState.SUCCEEDED


def test_a_low_battery_interrupts_the_drive_once_and_it_goes_on_after_charging() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        rig.advance(7.0)
        power(rig, 0.89)
        rig.advance(3.0)
        assert crew.navigator.cancelled == [2.0]
        power(rig, 0.95)
        rig.advance(5.0)
        assert crew.docking.cancelled == 0
        power(rig, 0.98)
        rig.advance(5.0)
        assert kinds(rig).count("mission.charged") == 1
        rig.advance(30.0)
        assert crew.navigator.reached == [1.0, 3.0]
        assert crew.state is MissionState.SUCCEEDED


def test_the_requirement_for_the_battery_says_when_to_charge() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        rig.advance(1.0)
        assert crew.requirement("MinBatterySystem") is True
        assert crew.requirement("MinBatteryNavigation") is None
        rig.advance(4.0)
        power(rig, 0.90)
        rig.advance(1.0)
        assert (crew.requirement("MinBatterySystem"), crew.docking.until) == (True, [])
        power(rig, 0.899)
        rig.advance(1.0)
        assert (crew.requirement("MinBatterySystem"), crew.docking.until) == (False, [0.98])
        power(rig, 0.98)
        rig.advance(11.0)
        assert crew.requirement("MinBatterySystem") is True
        assert len(crew.navigator.reached) >= 1
        assert crew.state is MissionState.RUNNING


def test_a_frontier_that_is_not_reached_is_given_back() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        crew.navigator.blocked = {2.0}
        rig.advance(40.0)
        assert crew.explorer.asked == [False, False, True, False]
        assert "the way is blocked" in crew.told("mission.frontier_missed")[0]
        assert crew.state is MissionState.SUCCEEDED


def test_where_a_sensor_fails_the_mission_says_so_and_waits_and_no_frontier_is_given_up() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        crew.navigator.blocked = {1.0}
        sensors(rig, "scan silent")
        rig.advance(30.0)
        assert "scan silent" in crew.told("mission.frontier_missed")[0]
        assert crew.explorer.asked == [False]
        sensors(rig)
        rig.advance(40.0)
        assert crew.explorer.asked == [False] * 4
        assert crew.state is MissionState.SUCCEEDED


def test_a_sensor_that_stays_away_ends_the_mission_with_the_reason() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        crew.navigator.blocked = {1.0}
        sensors(rig, "scan silent")
        rig.advance(180.0)
        assert crew.state is MissionState.FAILED
        assert "scan silent" in crew.told("mission.trouble")[-1]


def test_an_explorer_that_does_not_answer_at_first_is_asked_again() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        crew.explorer.failures = 3
        rig.advance(60.0)
        assert len(crew.told("mission.trouble")) == 3
        assert crew.state is MissionState.SUCCEEDED


def test_charging_that_fails_is_tried_again_and_then_given_up() -> None:
    with Rig() as rig:
        crew = Crew(rig, "explore")
        crew.docking.failures = 100
        power(rig, 0.5)
        rig.advance(100.0)
        assert len(crew.docking.until) == 5
        assert "no charger felt" in crew.told("mission.trouble")[0]
        assert crew.state is MissionState.FAILED


def test_visiting_looks_at_everything_and_tells_where_the_hydrant_is() -> None:
    with Rig() as rig:
        crew = Crew(rig, "visit")
        crew.detector.seen_from = {1.0}
        rig.publish("goals", goals("north", "east", "south"))
        rig.advance(60.0)
        assert crew.navigator.reached == [0.0, 1.0, 2.0]
        assert crew.detector.asked == [2, 2, 5]
        board = status(rig).blackboard
        assert (board["hydrant_x"], board["hydrant_y"]) == (1.0, 2.0)
        (told,) = [event for event in rig.events if event.kind == "mission.hydrant_located"]
        assert (told.details["x"], told.details["y"]) == (1.0, 2.0)
        assert crew.state is MissionState.SUCCEEDED


def test_what_was_visited_in_the_dark_is_visited_again() -> None:
    with Rig() as rig:
        crew = Crew(rig, "visit")
        crew.detector.seen_from = {0.0}
        rig.publish("goals", goals("north", "east"))
        darkness(rig, 0.9)
        rig.advance(8.0)
        assert crew.detector.asked == []
        darkness(rig, 0.1)
        rig.advance(30.0)
        assert crew.navigator.reached == [0.0, 1.0, 0.0]
        assert crew.state is MissionState.SUCCEEDED


def test_sightings_that_do_not_agree_locate_nothing_and_looking_ends() -> None:
    with Rig() as rig:
        crew = Crew(rig, "visit")
        crew.detector.seen_from, crew.detector.spread = {0.0}, 0.5
        rig.publish("goals", goals("north"))
        rig.advance(90.0)
        assert crew.state is MissionState.FAILED
        assert not crew.told("mission.hydrant_located")
        assert len(crew.navigator.reached) == 6


def test_a_goal_that_cannot_be_reached_is_told_and_left_out() -> None:
    with Rig() as rig:
        crew = Crew(rig, "visit")
        crew.navigator.blocked, crew.detector.seen_from = {0.0}, {1.0}
        rig.publish("goals", goals("north", "east"))
        rig.advance(60.0)
        assert crew.told("mission.goal_missed") == ["did not get to north"]
        assert crew.state is MissionState.SUCCEEDED


def test_a_visit_is_not_interrupted_by_the_battery_which_is_charged_after_it() -> None:
    with Rig() as rig:
        crew = Crew(rig, "visit")
        crew.detector.seen_from = {0.0}
        rig.publish("goals", goals("north", "east"))
        rig.advance(5.2)
        power(rig, 0.8)
        rig.advance(2.0)
        assert crew.detector.asked == [2, 5]
        assert crew.told("mission.hydrant_located")
        rig.advance(2.0)
        assert crew.docking.until == [0.98]
        power(rig, 0.98)
        rig.advance(30.0)
        assert crew.state is MissionState.SUCCEEDED


def test_searching_explores_then_changes_the_system_then_visits() -> None:
    with Rig() as rig:
        crew = Crew(rig, "search")
        crew.detector.seen_from = {1.0}
        rig.advance(29.0)
        assert status(rig).blackboard["phase"] == "changing"
        rig.publish("goals", goals("north", "east"))
        rig.advance(60.0)
        first, second = crew.manager.asked
        assert [change.component for change in first.changes] == ["obstacles", "localizer"]
        rests = [
            c.component for c in second.changes if isinstance(c, ChangeState) and c.transition.value == "deactivate"
        ]
        assert rests == ["mapper", "explorer"]
        assert status(rig).blackboard["map_file"] == "/maps/map.yaml"
        assert crew.state is MissionState.SUCCEEDED, status(rig).error


def test_a_system_that_cannot_be_changed_ends_the_search_with_the_reason() -> None:
    with Rig() as rig:
        crew = Crew(rig, "search")
        crew.manager.refuse = "there is none of this name"
        rig.advance(60.0)
        assert crew.state is MissionState.FAILED
        assert "there is none of this name" in crew.told("mission.trouble")[-1]


def test_a_look_with_a_broken_camera_is_told_and_made_up_for() -> None:
    with Rig() as rig:
        crew = Crew(rig, "visit")
        rig.publish("goals", goals("north", "east"))
        crew.detector.broken = True
        crew.detector.seen_from = {1.0}
        rig.advance(20.0)
        assert "none was of use" in crew.told("mission.trouble")[0]
        assert not crew.told("mission.hydrant_located")
        crew.detector.broken = False
        rig.advance(60.0)
        assert crew.told("mission.hydrant_located")
        assert crew.state is MissionState.SUCCEEDED
