"""When trees are ticked."""

from __future__ import annotations

from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import FROG, run, status, tree
from tests.executor.robot import PLACES, Detector, Navigator, goals

SLOW = 0.1
"""Ticks a second, so few that whatever happens soon happens for another reason."""


def test_an_answer_is_seen_without_waiting_for_the_next_periodic_tick() -> None:
    with Rig() as rig:
        rig.add(Detector)
        run(rig, tree('<Detect hits="{hits}"/>', '<Detect hits="{again}"/>'), rate=SLOW)
        rig.advance(0.6)
        now = status(rig)
        assert (now.state, now.blackboard["again"]) == (MissionState.SUCCEEDED, 1)


def test_the_end_of_a_drive_is_seen_without_waiting_for_the_next_periodic_tick() -> None:
    with Rig() as rig:
        rig.add(Navigator)
        run(rig, tree('<NavigateTo x="1" y="2"/>'), rate=SLOW)
        rig.advance(2.1)
        assert status(rig).state is MissionState.SUCCEEDED


def test_a_timing_node_is_ticked_when_its_time_has_come() -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep msec="250"/>', '<Sleep msec="250"/>'), rate=SLOW)
        rig.advance(0.49)
        assert status(rig).state is MissionState.RUNNING
        rig.advance(0.02)
        assert status(rig).state is MissionState.SUCCEEDED


def test_a_timeout_halts_in_time() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        run(rig, tree('<Timeout msec="700"><NavigateTo x="1" y="2"/></Timeout>'), rate=SLOW)
        rig.advance(0.8)
        assert navigator.cancelled == [1.0]
        assert status(rig).state is MissionState.FAILED


def test_an_endless_loop_of_leaves_that_complete_at_once_does_not_keep_the_component() -> None:
    with Rig() as rig:
        endless = '<Repeat num_cycles="-1"><Script code="n += 1"/></Repeat>'
        run(rig, tree('<Script code="n := 0"/>', endless))
        rig.advance(2.0)
        now = status(rig)
        assert now.state is MissionState.RUNNING
        assert now.blackboard["n"] > 100


def test_an_idle_tree_is_ticked_at_its_rate() -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep msec="100000"/>'), rate=20.0)
        before = status(rig).ticks
        rig.advance(2.0)
        assert status(rig).ticks - before == 40


def trace() -> list[MissionStatus]:
    """Return what a run of FROG's mission with some failures publishes."""
    with Rig(seed=3) as rig:
        published = rig.collect("mission", MissionStatus)
        rig.add(Navigator, parameters={"failures": 2})
        rig.add(Detector, parameters={"failures": 1})
        rig.add(Executor, "bt_executor", {"mission": str(FROG)})
        rig.publish("goals", goals(*PLACES))
        rig.advance(60.0)
        return published


def test_equal_runs_give_equal_traces() -> None:
    first = trace()
    assert len(first) > 20
    assert first == trace()
