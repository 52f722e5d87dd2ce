"""A mission's blackboards are read and written from outside."""

from __future__ import annotations

import pytest

from behavior_tree import Input, Status, SyncAction
from behavior_tree.status import SUCCESS
from regraft import CallFailed
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Vector3
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BlackboardRequest,
    Command,
    MissionState,
    WriteBlackboard,
)
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, entry, run, status, tree

WAIT = '<Sleep name="wait" msec="100000"/>'
SUBTREE = """<root BTCPP_format="4" main_tree_to_execute="Main">
<BehaviorTree ID="Main"><Sequence>
  <SubTree ID="Inner" name="inner" given="{outer}" fixed="5"/>
</Sequence></BehaviorTree>
<BehaviorTree ID="Inner"><Sequence><Script code="own := 3"/><Sleep msec="100000"/></Sequence></BehaviorTree></root>"""


class Takes(SyncAction):
    """Takes a message of the bus and a list."""

    place = Input(Vector3)
    numbers = Input(list[int])

    def tick(self) -> Status:
        """Succeed."""
        return SUCCESS


NODES = "tests.executor.test_blackboard:Takes"


def read(rig: Rig, key: str = "", board: str = "") -> BlackboardEntries:
    """Read a board."""
    return rig.call("mission/blackboard", BlackboardRequest(key, board), BlackboardEntries)


def write(rig: Rig, values: dict[str, PlainValue], board: str = "") -> BlackboardEntries:
    """Write to a board."""
    return rig.call("mission/write", WriteBlackboard(values, board), BlackboardEntries)


def refused(rig: Rig, values: dict[str, PlainValue], board: str = "") -> str:
    """Write what must be refused; returns why."""
    before = read(rig)
    with pytest.raises(CallFailed) as failed:
        write(rig, values, board)
    after = read(rig)
    assert [(e.key, e.value, e.type, e.sequence) for e in before.entries] == [
        (e.key, e.value, e.type, e.sequence) for e in after.entries
    ]
    return failed.value.why


def test_an_entry_has_value_type_writes_and_age() -> None:
    with Rig() as rig:
        run(rig, tree('<Script code="n := 1; n += 1"/>', WAIT))
        rig.advance(0.1)
        rig.advance(2.0)
        found = entry(rig, "n")
        assert (found.value, found.type, found.sequence) == (2, "int", 2)
        assert found.age == pytest.approx(2.0, abs=0.11)


def test_an_entry_that_nobody_has_written_has_no_age() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT, '<NavigateTo x="{x}" y="0"/>'))
        rig.advance(0.5)
        found = entry(rig, "x")
        assert (found.value, found.type, found.sequence, found.age) == (None, "float", 0, None)


def test_what_is_written_is_what_the_tree_reads_soon() -> None:
    with Rig() as rig:
        waiting = '<WaitValueUpdate entry="go"><Script code="seen := go + 1"/></WaitValueUpdate>'
        run(rig, tree(waiting), rate=0.1)
        rig.advance(0.3)
        written = write(rig, {"go": 4})
        assert [(e.key, e.value, e.type) for e in written.entries] == [("go", 4, "int")]
        rig.advance(0.01)
        now = status(rig)
        assert (now.state, now.blackboard["seen"]) == (MissionState.SUCCEEDED, 5.0)


def test_writing_keeps_to_the_types_of_the_engine() -> None:
    with Rig() as rig:
        run(rig, tree("<Script code=\"n := 1; label := 'box'\"/>", WAIT, '<NavigateTo x="{x}" y="0"/>'))
        rig.advance(0.5)
        write(rig, {"n": 2.0, "x": "1.5", "new": [1, {"a": None}]})
        assert [entry(rig, key).value for key in ("n", "x", "new")] == [2, 1.5, [1, {"a": None}]]
        assert "2.5 is not a whole number" in refused(rig, {"n": 2.5})
        assert "holds text, not int" in refused(rig, {"label": 3})
        assert "'here' is not a number" in refused(rig, {"x": "here"})
        assert "of type float" in refused(rig, {"x": [1.0]})


def test_one_value_that_does_not_fit_keeps_all_from_being_written() -> None:
    with Rig() as rig:
        run(rig, tree('<Script code="n := 1; m := 2"/>', WAIT))
        rig.advance(0.5)
        refused(rig, {"m": 5, "fresh": 1, "n": "no number"})
        assert entry(rig, "m").sequence == 1


def test_entries_of_message_types_take_maps_and_lists_their_items() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT, '<Takes place="{place}" numbers="{numbers}"/>'), nodes=NODES)
        write(rig, {"place": {"x": 1.0, "y": 2.0, "z": 0.0}, "numbers": ["1", 2]})
        assert (entry(rig, "place").value, entry(rig, "numbers").value) == ({"x": 1.0, "y": 2.0, "z": 0.0}, [1, 2])
        assert "'w'" in refused(rig, {"place": {"w": 1.0}})
        assert "not a number" in refused(rig, {"numbers": ["one"]}) or "whole number" in refused(
            rig, {"numbers": ["one"]}
        )


def test_none_removes_an_entry() -> None:
    with Rig() as rig:
        run(rig, tree('<Script code="n := 1"/>', WAIT))
        rig.advance(0.5)
        assert write(rig, {"n": None}).entries == ()
        assert "n" not in status(rig).blackboard


@pytest.mark.parametrize("key", ["", "@n", "{n}", " n", "n\n", "x" * 300])
def test_what_no_tree_can_name_is_no_key(key: str) -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        assert "is no key" in refused(rig, {key: 1})


@pytest.mark.parametrize("value", ["x" * 3000, 2**63, b"bytes", [[[[[[[1]]]]]]]])
def test_values_that_could_not_be_shown_are_refused(value: PlainValue) -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        assert "must be numbers" in refused(rig, {"n": value})


def test_nothing_and_too_much_are_refused() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        assert "nothing to write" in refused(rig, {})
        assert "at most 100" in refused(rig, {f"k{n}": n for n in range(101)})


def test_sub_trees_have_boards_of_their_own() -> None:
    with Rig() as rig:
        run(rig, SUBTREE)
        rig.advance(0.5)
        assert read(rig).boards == ("inner",)
        inner = read(rig, board="inner")
        assert {e.key: e.value for e in inner.entries} == {"fixed": 5, "own": 3}
        write(rig, {"own": 4, "given": "through"}, "inner")
        assert read(rig, "own", "inner").entries[0].value == 4
        assert read(rig, "given", "inner").entries[0].value == "through"
        assert entry(rig, "outer").value == "through"
        assert "there are: inner" in refused(rig, {"a": 1}, "outer")


def test_a_sub_tree_with_the_main_trees_name_keeps_its_own_board() -> None:
    xml = SUBTREE.replace('"Main"', '"Patrol"').replace('name="inner"', 'name="Patrol"')
    with Rig() as rig:
        run(rig, xml)
        rig.advance(0.5)
        assert read(rig).boards == ("Patrol",)
        assert read(rig, "own", "Patrol").entries[0].value == 3
        write(rig, {"own": 4}, "Patrol")
        assert read(rig, "own", "Patrol").entries[0].value == 4
        assert "own" not in {found.key for found in read(rig).entries}


def test_the_main_trees_name_is_the_root_board_where_no_sub_tree_has_it() -> None:
    with Rig() as rig:
        run(rig, SUBTREE)
        write(rig, {"n": 1}, "Main")
        assert entry(rig, "n").value == 1


def test_names_that_lead_nowhere_are_refused() -> None:
    with Rig() as rig:
        rig.add(Executor)
        with pytest.raises(CallFailed, match="load one"):
            read(rig)
        with pytest.raises(CallFailed, match="load one"):
            write(rig, {"n": 1})
        command(rig, Command.LOAD, tree('<Script code="n := 1"/>', WAIT))
        with pytest.raises(CallFailed, match="there is no blackboard entry 'm'"):
            read(rig, "m")


def test_writes_are_told_as_events() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        write(rig, {"n": 5, "label": "box"})
        event = rig.events[-1]
        assert (event.kind, event.text) == ("mission.written", "n = 5, label = box")
        assert event.details == {"values": {"n": 5, "label": "box"}, "board": ""}
