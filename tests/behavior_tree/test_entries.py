"""The types of blackboard entries: how they are fixed, and which entries stay open."""

import pytest

from behavior_tree import Blackboard, BlackboardError
from tests.behavior_tree.trees import ticks, tree_of


def test_entry_that_a_script_created_takes_the_type_of_the_node_that_writes_it() -> None:
    tree = tree_of("<Script code='v := 1'/>")
    assert ticks(tree, 1) == "S"
    tree.blackboard.set("v", "text")
    assert tree.blackboard.get("v") == "text"
    with pytest.raises(BlackboardError, match="holds text"):
        tree.blackboard.set("v", 2)


def test_new_text_leaves_an_entry_open_and_the_next_write_fixes_its_type() -> None:
    board = Blackboard()
    board.set("v", "text")
    board.set("v", [1], list[int])
    entry = board.find("v")
    assert entry is not None
    assert (entry.value, entry.type) == ([1], list[int])


def test_set_blackboard_creates_its_entry_also_from_an_empty_one() -> None:
    tree = tree_of(
        '<Sequence><Script code="v := w" _skipIf="true"/><SetBlackboard value="{e}" output_key="v"/></Sequence>'
    )
    tree.blackboard.declare("e")
    assert ticks(tree, 1) == "F"
    assert tree.blackboard.dump() == {"e": None, "v": None}
