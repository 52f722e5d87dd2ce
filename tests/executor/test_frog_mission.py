"""FROG's mission does what it says, and survives what happens to the components that it needs."""

from __future__ import annotations

from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.model.lifecycle import Transition
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import FROG, status
from tests.executor.robot import PLACES, Detector, Navigator, goals


def start(rig: Rig) -> Executor:
    """Start the mission's executor."""
    return rig.add(Executor, "bt_executor", {"mission": str(FROG)})


def test_goals_are_visited_in_their_order_again_and_again() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals(*PLACES))
        rig.advance(170.0)
        assert navigator.reached[:10] == [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0]


def test_the_detector_is_asked_five_times_on_each_leg() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 20.0})
        detector = rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(19.0)
        assert len(detector.asked) == 5
        assert navigator.asked == [0.0]
        rig.advance(20.0)
        assert len(detector.asked) == 10
        assert navigator.asked == [0.0, 1.0]


def test_the_mission_waits_for_goals() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Detector)
        start(rig)
        rig.advance(5.0)
        rig.publish("goals", goals())
        rig.advance(5.0)
        assert navigator.asked == []
        assert status(rig).running == ("GetGoals::3",)
        rig.publish("goals", goals("north"))
        rig.advance(1.0)
        assert navigator.asked == [0.0]


def test_new_goals_count_from_the_next_round() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north"))
        rig.advance(1.0)
        rig.publish("goals", goals("north", "east", "south"))
        rig.advance(80.0)
        assert navigator.asked[:5] == [0.0, 1.0, 2.0, 0.0, 1.0]


def test_a_drive_that_fails_is_tried_again_after_a_pause() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"failures": 2})
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(4.9)
        assert navigator.asked == [0.0, 0.0]
        rig.advance(15.0)
        assert navigator.asked == [0.0, 0.0, 0.0, 1.0]
        assert navigator.reached[0] == 0.0


def test_a_goal_that_cannot_be_reached_is_reported_and_left_out_of_the_round() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"failures": 3})
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(20.0)
        assert navigator.reached == [1.0]
        missed = [event.text for event in rig.events if event.kind == "mission.goal_missed"]
        assert missed == ["did not get to north: the way is blocked"]


def test_a_detector_that_refuses_is_asked_again() -> None:
    with Rig() as rig:
        rig.add(Navigator)
        detector = rig.add(Detector, parameters={"failures": 2})
        start(rig)
        rig.publish("goals", goals("north"))
        rig.advance(20.0)
        assert len(detector.asked) == 7
        assert status(rig).blackboard["hits"] == 1


def test_the_mission_goes_on_when_an_absent_navigator_appears() -> None:
    with Rig() as rig:
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(8.0)
        navigator = rig.add(Navigator)
        rig.advance(20.0)
        assert navigator.reached
        assert status(rig).state is MissionState.RUNNING


def test_the_mission_goes_on_when_an_absent_detector_appears() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(40.0)
        detector = rig.add(Detector)
        rig.advance(170.0)
        assert len(detector.asked) > 10
        assert len(navigator.reached) > 3


def test_the_mission_goes_on_when_the_navigator_is_ended_and_started_again() -> None:
    with Rig() as rig:
        rig.add(Navigator)
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(1.0)
        rig.runtimes.pop("navigator").leave()
        rig.advance(1.0)
        successor = rig.add(Navigator)
        rig.advance(25.0)
        assert successor.asked[0] == 0.0
        assert 1.0 in successor.reached


def test_a_navigator_that_is_deactivated_for_a_while_is_waited_for() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Detector)
        start(rig)
        rig.publish("goals", goals("north", "east"))
        rig.advance(1.0)
        rig.transition("navigator", Transition.DEACTIVATE)
        rig.advance(1.5)
        rig.transition("navigator", Transition.ACTIVATE)
        rig.advance(25.0)
        assert navigator.cancelled == [0.0]
        assert navigator.reached[:2] == [0.0, 1.0]
