"""The stubs of SUAVE's nodes replay their schedules, and take the time that they state."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.health import Diagnostic, Level
from regraft.bus_schema.messages.management.objectives import QUALITY_STATUS
from regraft.bus_schema.model.lifecycle import Transition
from regraft.stacks.suave.functions import (
    PipelineDetection,
    PipelineFollower,
    RechargeBattery,
    RecoverThrusters,
)
from regraft.stacks.suave.messages import BatteryLevel, Detection, Inspection, Search
from regraft.stacks.suave.monitors import BatteryMonitor, ThrusterMonitor, WaterVisibilityObserver, visibility
from regraft.testing import Rig


def values(published: list[Diagnostic]) -> list[tuple[float, dict[str, object]]]:
    """Return the times and values of diagnostics."""
    return [(round(each.stamp, 3), dict(each.values)) for each in published]


@given(st.floats(0.0, 1e5), st.floats(0.0, 50.0), st.floats(0.0, 50.0), st.floats(1.0, 1e4))
def test_the_visibility_stays_between_its_bounds(elapsed: float, lowest: float, more: float, period: float) -> None:
    assert lowest - 1e-9 <= visibility(elapsed, lowest, lowest + more, period) <= lowest + more + 1e-9


def test_the_visibility_is_published_once_a_second_by_a_cosine_from_its_highest_on() -> None:
    with Rig() as rig:
        published = rig.collect("diagnostics", Diagnostic)
        rig.add(WaterVisibilityObserver)
        rig.advance(80.0)
    found = [each.values["water_visibility"] for each in published]
    assert len(found) in (80, 81)
    assert found[-1] == 3.75
    assert min(found, key=float) == 1.25
    assert {each.text for each in published} == {QUALITY_STATUS}


def test_a_constant_visibility_is_exactly_that() -> None:
    with Rig() as rig:
        published = rig.collect("diagnostics", Diagnostic)
        rig.add(WaterVisibilityObserver, parameters={"water_visibility_min": 2.25, "water_visibility_max": 2.25})
        rig.advance(90.0)
    assert {each.values["water_visibility"] for each in published} == {2.25}


def test_thrusters_fail_and_recover_by_the_schedule_one_at_a_time() -> None:
    events = [{"thruster": 1, "at": 3.0}, {"thruster": 6, "at": 3.0}, {"thruster": 1, "at": 4.5, "failure": False}]
    with Rig() as rig:
        published = rig.collect("diagnostics", Diagnostic)
        rig.add(ThrusterMonitor, parameters={"thruster_events": events})
        rig.advance(10.0)
    assert [value for _, value in values(published)] == [
        {"c_thruster_1": "FALSE"},
        {"c_thruster_6": "FALSE"},
        {"c_thruster_1": "RECOVERED"},
    ]
    assert [time for time, _ in values(published)] == [3.0, 4.0, 5.0]


@pytest.mark.parametrize("number", [0, 7])
def test_a_thruster_that_there_is_not_is_refused(number: int) -> None:
    with Rig() as rig, pytest.raises(Exception, match=r"thruster"):
        rig.add(ThrusterMonitor, parameters={"thruster_events": [{"thruster": number, "at": 1.0}]})


def test_all_thrusters_are_recovered_after_ten_seconds_and_not_by_one_that_is_deactivated_before() -> None:
    with Rig() as rig:
        published = rig.collect("diagnostics", Diagnostic)
        rig.add(RecoverThrusters, "recovery")
        rig.advance(9.0)
        rig.transition("recovery", Transition.DEACTIVATE)
        rig.advance(5.0)
        assert published == []
        rig.transition("recovery", Transition.ACTIVATE)
        rig.advance(15.0)
    assert [next(iter(each.values)) for each in published] == [f"c_thruster_{number}" for number in range(1, 7)]
    assert published[0].stamp >= 14.0 + 10.0


def test_the_battery_falls_steadily_and_is_full_when_the_vehicle_has_been_at_the_station() -> None:
    with Rig() as rig:
        published = rig.collect("battery_level", BatteryLevel)
        rig.add(BatteryMonitor, parameters={"discharge_time": 20.0})
        rig.advance(15.0)
        assert published[-1].level == 0.25
        rig.add(RechargeBattery, parameters={"travel_time": 2.0})
        rig.advance(3.0)
        assert max(each.level for each in published[-3:]) == 1.0
        rig.advance(60.0)
        assert published[-1].level == 0.0, "it is charged once"


def test_ground_is_not_seen_from_above_the_visibility() -> None:
    with Rig() as rig:
        published = rig.collect("detection", Detection)
        rig.add(PipelineDetection, parameters={"area": 1.0})
        for altitude, seen in ((3.0, 2.99), (1.0, 1.0)):
            rig.publish("diagnostics", Diagnostic(0.0, "", "", Level.OK, QUALITY_STATUS, {"water_visibility": seen}))
            for _ in range(3):
                rig.publish("search", Search(0.0, altitude))
            rig.advance(1.0)
    assert [each.detected for each in published][-2:] == [False, True]


def test_the_inspection_ends_with_the_pipeline_and_continues_where_it_was_left() -> None:
    with Rig() as rig:
        published = rig.collect("inspection", Inspection)
        rig.add(PipelineFollower, "follower", parameters={"length": 1.0})
        rig.advance(2.0)
        rig.transition("follower", Transition.DEACTIVATE)
        rig.advance(10.0)
        rig.transition("follower", Transition.ACTIVATE)
        rig.advance(4.0)
    assert [each.inspected for each in published[:3]] == [False, False, False]
    assert (published[-1].distance, published[-1].inspected) == (1.0, True)
