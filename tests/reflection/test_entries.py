"""What is reflected stands on the root blackboard: each value once, its age at every tick, stale when it is stale."""

from __future__ import annotations

from typing import Any

import pytest

from behavior_tree import Blackboard, Entry
from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.bus_schema.messages.reflection import ReflectedEntries, ReflectedEntry
from regraft.bus_schema.model.lifecycle import Transition
from regraft.services.bt_executor.executor import Executor
from regraft.services.system_reflection import SystemReflection
from regraft.testing import Rig
from tests.executor.helpers import command, run, status, tree
from tests.reflection.parts import Wheels, battery_state, odometry_of

SPEED = {"topic": "odometry", "field": "twist.linear.x", "entry": "speed", "rate": 10, "stale_after": 1.0}
CHARGE = {"topic": "battery", "field": "charge", "entry": "charge", "rate": 2}
IDLE = tree('<Sleep msec="1000000"/>')


def reflect(rig: Rig, *mapping: dict[str, Any]) -> None:
    """Start a system reflection."""
    rig.add(SystemReflection, "system_reflection", {"mapping": list(mapping)})


def board_of(rig: Rig) -> Blackboard:
    """Return the mission's root blackboard."""
    executor = rig.runtimes["bt_executor"].component
    assert isinstance(executor, Executor)
    mission = executor._mission.tree
    assert mission is not None
    return mission.blackboard


def entry(rig: Rig, key: str) -> Entry:
    """Return an entry of the root blackboard."""
    found = board_of(rig).find(key)
    assert found is not None, f"there is no entry {key}"
    return found


def test_a_value_comes_with_its_type_and_its_age() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        reflect(rig, SPEED)
        rig.publish("odometry", odometry_of(0.0, 0.25))
        rig.advance(0.5)
        speed = entry(rig, "speed")
        assert (speed.value, speed.type, speed.sequence) == (0.25, float, 1)
        assert entry(rig, "speed_age").value == pytest.approx(0.5)
        assert entry(rig, "speed_stale").value is False


def test_a_value_never_received_is_an_empty_entry_without_age_and_stale() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        reflect(rig, SPEED)
        rig.advance(0.5)
        assert entry(rig, "speed").value is None
        assert entry(rig, "speed").sequence == 0
        assert board_of(rig).find("speed_age") is None
        assert entry(rig, "speed_stale").value is True


def test_a_stale_value_is_seen_as_stale_and_a_fresh_one_again_as_fresh() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        rig.add(Wheels)
        reflect(rig, SPEED)
        rig.advance(1.0)
        assert entry(rig, "speed_age").value <= 0.2
        rig.transition("wheels", Transition.DEACTIVATE)
        rig.advance(0.5)
        assert entry(rig, "speed_stale").value is False
        rig.advance(5.0)
        assert entry(rig, "speed").value == 0.2
        assert entry(rig, "speed_age").value == pytest.approx(5.5, abs=0.2)
        assert entry(rig, "speed_stale").value is True
        written = entry(rig, "speed_stale").sequence
        rig.transition("wheels", Transition.ACTIVATE)
        rig.advance(0.5)
        assert entry(rig, "speed_stale").value is False
        assert entry(rig, "speed_stale").sequence == written + 1


def test_a_stale_value_is_seen_as_stale_also_when_the_reflection_itself_is_gone() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        rig.add(Wheels)
        reflect(rig, SPEED)
        rig.advance(1.0)
        rig.transition("system_reflection", Transition.DEACTIVATE)
        rig.advance(5.0)
        assert entry(rig, "speed_age").value == pytest.approx(5.0, abs=0.2)
        assert entry(rig, "speed_stale").value is True


def test_each_value_is_written_once_also_when_another_entry_is_new() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        reflect(rig, SPEED, CHARGE)
        rig.publish("battery", battery_state(0.0, 0.5))
        for _ in range(10):
            rig.publish("odometry", odometry_of(rig.clock.now() / 1e9, 0.2))
            rig.advance(0.1)
        assert entry(rig, "charge").sequence == 1
        assert entry(rig, "speed").sequence >= 9


def test_a_mission_reacts_to_a_stale_value() -> None:
    watching = tree(
        '<RetryUntilSuccessful num_attempts="-1"><Delay delay_msec="100">'
        '<ScriptCondition code="@speed_stale"/></Delay></RetryUntilSuccessful>'
    )
    with Rig() as rig:
        rig.add(Wheels)
        reflect(rig, SPEED)
        rig.add(Executor, "bt_executor", {"autostart": False})
        command(rig, Command.LOAD, IDLE)
        command(rig, Command.START)
        rig.advance(1.0)
        command(rig, Command.LOAD, watching)
        command(rig, Command.START)
        rig.advance(3.0)
        assert status(rig).state is MissionState.RUNNING
        rig.transition("wheels", Transition.DEACTIVATE)
        rig.advance(2.0)
        assert status(rig).state is MissionState.SUCCEEDED


def test_another_mission_finds_the_entries_with_their_ages() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        reflect(rig, SPEED)
        rig.publish("odometry", odometry_of(0.0, 0.25))
        rig.advance(2.0)
        command(rig, Command.LOAD, tree('<ScriptCondition code="@speed > 0.2 &amp;&amp; @speed_age > 1.9"/>'))
        command(rig, Command.STEP)
        assert status(rig).state is MissionState.SUCCEEDED


def test_an_entry_of_another_type_is_told_of_once_and_the_others_are_written() -> None:
    with Rig() as rig:
        run(rig, tree("<Script code=\"@speed := 'fast'\"/>", '<Sleep msec="1000000"/>'))
        rig.add(Wheels)
        reflect(rig, SPEED, CHARGE)
        rig.publish("battery", battery_state(0.0, 0.5))
        rig.advance(3.0)
        assert entry(rig, "charge").value == 0.5
        assert entry(rig, "speed").value == "fast"
        refused = [event.text for event in rig.events if event.kind == "reflection.refused"]
        assert refused == ["blackboard entry 'speed' holds text, not float"]
        assert status(rig).state is MissionState.RUNNING


def test_the_own_inputs_have_ages_too_and_give_way_to_the_mapping() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        rig.publish("battery", battery_state(0.0, 0.5))
        rig.advance(2.0)
        assert entry(rig, "battery_charge").value == 0.5
        assert entry(rig, "battery_charge_age").value == pytest.approx(2.0)
        reflect(rig, {"topic": "spare", "field": "charge", "entry": "battery_charge", "rate": 10})
        rig.publish("spare", battery_state(2.0, 0.75))
        rig.advance(1.0)
        rig.publish("battery", battery_state(3.0, 0.25))
        rig.advance(1.0)
        assert entry(rig, "battery_charge").value == 0.75
        assert entry(rig, "battery_charge").sequence == 2


def test_after_a_restart_of_the_reflection_what_was_known_stays_and_ages() -> None:
    with Rig() as rig:
        run(rig, IDLE)
        rig.publish("reflection", ReflectedEntries(0.0, (ReflectedEntry("speed", 0.2, 0.0, 7, 1.0),)))
        rig.advance(0.5)
        rig.publish("reflection", ReflectedEntries(0.5, (ReflectedEntry("speed", stale_after=1.0),)))
        rig.advance(2.5)
        assert entry(rig, "speed").value == 0.2
        assert entry(rig, "speed_age").value == pytest.approx(3.0)
        rig.publish("reflection", ReflectedEntries(0.0, (ReflectedEntry("speed", 0.2, 0.0, 7, 1.0),)))
        rig.advance(0.5)
        assert entry(rig, "speed").sequence == 1, "the same message of the source is no news"


def test_after_a_restart_of_the_executor_what_was_known_goes_on_ageing() -> None:
    with Rig() as rig:
        executor = run(rig, IDLE)
        reflect(rig, SPEED)
        rig.publish("odometry", odometry_of(0.0, 0.25))
        rig.advance(2.0)
        state = executor.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        rig.advance(3.0)
        second = rig.add(Executor, "bt_executor", {"autostart": False})
        second.restore(state)
        command(rig, Command.START)
        rig.advance(1.0)
        assert entry(rig, "speed").value == 0.25
        now = rig.clock.now() / 1e9
        assert entry(rig, "speed_age").value == pytest.approx(now, abs=0.1)
        assert entry(rig, "speed_stale").value is True
        rig.publish("odometry", odometry_of(now, 0.5))
        rig.advance(0.5)
        assert entry(rig, "speed").value == 0.5
        assert entry(rig, "speed_stale").value is False
