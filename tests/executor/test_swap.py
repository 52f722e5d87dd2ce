"""Another tree takes over while a mission is under way."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behavior_tree import Blackboard, ManualClock
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.mission import Command, MissionState, NodeStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.services.bt_executor.boards import carry_over
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, entry, kinds, node_statuses, refusal, run, status, tree
from tests.executor.robot import Navigator

DRIVE = '<NavigateTo name="drive" x="3.0" y="4.0"/>'
WAIT = '<Sleep name="wait" msec="100000"/>'


def test_another_tree_takes_over_at_once_and_the_old_ones_goal_is_cancelled() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        run(rig, tree(DRIVE, name="Old"))
        rig.advance(1.0)
        swapped = command(rig, Command.SWAP, tree(WAIT, name="New"))
        assert (swapped.tree, swapped.state, swapped.ticks) == ("New", MissionState.RUNNING, 1)
        assert swapped.running == ("wait",)
        rig.advance(0.1)
        assert navigator.cancelled == [3.0]
        assert kinds(rig) == ["mission.loaded", "mission.started", "mission.swapped"]


def test_the_structure_tells_that_another_tree_took_over() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        rig.advance(0.5)
        before = status(rig).structure
        assert command(rig, Command.SWAP, tree(WAIT)).structure == before
        assert command(rig, Command.SWAP, tree(DRIVE)).structure != before


def test_the_blackboard_is_carried_over_with_its_ages() -> None:
    with Rig() as rig:
        run(rig, tree("<Script code=\"n := 7; label := 'box'\"/>", WAIT, name="Old"))
        rig.advance(2.05)
        board = command(rig, Command.SWAP, tree('<Script code="m := n + 1"/>', WAIT, name="New")).blackboard
        assert (board["n"], board["label"], board["m"]) == (7, "box", 8)
        age = entry(rig, "n").age
        assert age is not None
        assert age > 1.9
        (event,) = [event for event in rig.events if event.kind == "mission.swapped"]
        assert event.details["carried"] == ["n", "label"]
        assert (event.details["before"], event.details["after"]) == ("Old", "New")


def test_an_entry_of_another_type_is_not_carried_over_and_told() -> None:
    with Rig() as rig:
        run(rig, tree("<Script code=\"x := 'here'; y := 2; z := '3'\"/>", WAIT))
        rig.advance(0.5)
        new = tree('<Sleep msec="100000"/>', '<NavigateTo x="{x}" y="{y}" yaw="{z}"/>')
        board = command(rig, Command.SWAP, new).blackboard
        assert (board["x"], board["y"], board["z"]) == (None, 2.0, 3.0)
        (event,) = [event for event in rig.events if event.kind == "mission.swapped"]
        assert list(event.details["clashes"]) == ["x"]
        assert "'here' is not a number" in event.text


def test_a_bad_tree_changes_nothing() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT, name="Old"))
        rig.publish("battery", BatteryState(0.0, 5.0, 10.0, 0.5, 1.0))
        rig.advance(0.5)
        before, written = status(rig), entry(rig, "battery_charge").sequence
        why = refusal(rig, Command.SWAP, tree(DRIVE, "<Unknown/>"))
        assert ":3:" in why
        assert "Unknown" in why
        now = status(rig)
        assert (now.tree, now.state, now.running) == (before.tree, before.state, before.running)
        rig.advance(0.5)
        assert entry(rig, "battery_charge").sequence == written


def test_a_tree_is_checked_beside_the_one_that_runs() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT, name="Old"))
        rig.advance(0.5)
        before = status(rig)
        assert command(rig, Command.CHECK, tree(DRIVE, name="New")) == before
        why = refusal(rig, Command.CHECK, tree(DRIVE, "<Unknown/>"))
        assert ":3:" in why
        assert "Unknown" in why
        assert status(rig) == before


@pytest.mark.parametrize("halt", [False, True])
def test_without_a_mission_under_way_there_is_nothing_to_take_over_from(halt: bool) -> None:
    with Rig() as rig:
        rig.add(Executor)
        assert "there is no tree" in refusal(rig, Command.SWAP, tree(WAIT))
        command(rig, Command.LOAD, tree(WAIT))
        if halt:
            command(rig, Command.START)
            command(rig, Command.HALT)
        assert "load, then start" in refusal(rig, Command.SWAP, tree(WAIT))


def test_a_paused_mission_stays_paused_at_the_new_root() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT, name="Old"))
        rig.advance(0.5)
        command(rig, Command.PAUSE)
        swapped = command(rig, Command.SWAP, tree(WAIT, name="New"))
        assert (swapped.tree, swapped.state, swapped.ticks) == ("New", MissionState.PAUSED, 0)
        assert set(node_statuses(swapped).values()) == {NodeStatus.IDLE}
        assert command(rig, Command.STEP).ticks == 1


def test_without_a_tree_the_file_of_the_mission_takes_over(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text(tree(WAIT, name="Filed"))
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"mission": str(file)})
        command(rig, Command.SWAP, tree(WAIT, name="Other"))
        assert command(rig, Command.SWAP).tree == "Filed"


def test_the_old_trees_last_wishes_are_carried_over() -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep msec="100000" _onHalted="left := 1"/>'))
        rig.advance(0.5)
        assert command(rig, Command.SWAP, tree(WAIT)).blackboard["left"] == 1


def test_an_error_while_the_old_tree_halts_is_told_and_the_new_one_runs() -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep name="sulking" msec="100000" _onHalted="missing += 1"/>'))
        rig.advance(0.5)
        assert command(rig, Command.SWAP, tree(WAIT)).running == ("wait",)
        (event,) = [event for event in rig.events if event.kind == "mission.swapped"]
        assert "sulking" in event.text


def test_a_successor_has_the_tree_that_took_over() -> None:
    with Rig() as rig:
        first = run(rig, tree(WAIT, name="Old"))
        command(rig, Command.SWAP, tree('<Script code="n := 1"/>', WAIT, name="New"))
        state = first.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        second = rig.add(Executor, "second")
        second.restore(state)
        assert (status(rig).tree, status(rig).blackboard["n"]) == ("New", 1)


plain = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | st.text(max_size=5)
kinds_of_entries = st.sampled_from([None, int, float, str, bool])


@settings(deadline=None)
@given(
    st.dictionaries(st.sampled_from("abcd"), plain, max_size=4),
    st.dictionaries(st.sampled_from("abcd"), kinds_of_entries, max_size=4),
)
def test_every_entry_is_carried_over_in_the_new_type_or_told(
    values: dict[str, PlainValue], types: dict[str, type | None]
) -> None:
    clock = ManualClock(5.0)
    old, new = Blackboard(clock=clock), Blackboard(clock=clock)
    for key, value in values.items():
        old.set(key, value)
    for key, kind in types.items():
        new.declare(key, kind)
    clock.advance(3.0)
    carried = carry_over(old, new)
    assert {*carried.keys, *carried.clashes} == set(values)
    for key in carried.keys:
        found = new.find(key)
        assert found is not None
        assert (found.sequence, found.stamp) == (1, 5.0)
        # A type that is text gives way, as everywhere: text converts to everything.
        assert found.type is (types[key] if types.get(key) not in (None, str) else type(values[key]))
        assert type(found.value) is found.type
    for key in carried.clashes:
        found = new.find(key)
        assert found is not None
        assert (found.value, found.sequence, found.type) == (None, 0, types[key])
