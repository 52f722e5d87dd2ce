"""The decorators that take items off a queue."""

from collections import deque
from typing import Any

import pytest

from behavior_tree import LoadError, NodeError, Tree
from tests.behavior_tree.trees import leaf, statuses, ticks, tree_of


def looped(kind: str, queue: str, script: str = "S", ports: str = "", events: list[str] | None = None) -> Tree:
    body = f'<Loop{kind} queue="{queue}" value="{{item}}" {ports}>{leaf(script, "n")}</Loop{kind}>'
    return tree_of(body, events=events)


@pytest.mark.parametrize(
    ("kind", "text", "items"),
    [
        ("Int", "3;-2;1", [3, -2, 1]),
        ("Bool", "1;false", [True, False]),
        ("Double", "0.5;2", [0.5, 2.0]),
        ("String", "left;right", ["left", "right"]),
    ],
)
def test_items_are_taken_one_a_tick_and_then_it_succeeds(kind: str, text: str, items: list[Any]) -> None:
    tree = looped(kind, text)
    seen = []
    for _ in items:
        assert ticks(tree, 1) == "R"
        seen.append(tree.blackboard.get("item"))
    assert [(type(item), item) for item in seen] == [(type(item), item) for item in items]
    assert ticks(tree, 1) == "S"


def test_text_is_read_anew_at_every_start() -> None:
    events: list[str] = []
    tree = looped("Int", "1;2", "SF", events=events)
    assert ticks(tree, 2) == "RF"
    assert ticks(tree, 2) == "RF"
    tree.tick_once()
    tree.halt_tree()
    assert ticks(tree, 1) == "F"
    assert tree.blackboard.get("item") == 1
    assert len(events) == 6


@pytest.mark.parametrize(("status", "letter"), [("SUCCESS", "S"), ("FAILURE", "F"), ("SKIPPED", "K"), ("RUNNING", "R")])
def test_empty_queue_gives_the_status_that_is_asked_for(status: str, letter: str) -> None:
    assert ticks(looped("Int", "", ports=f'if_empty="{status}"'), 1) == letter
    tree = looped("String", "{nothing}", ports=f'if_empty="{status}"')
    tree.blackboard.set("nothing", [])
    assert ticks(tree, 1) == letter


def test_queue_that_was_never_written_is_an_error() -> None:
    with pytest.raises(NodeError, match=r"input 'queue' from entry 'nothing': .* is empty"):
        ticks(looped("String", "{nothing}"), 1)


def test_running_child_keeps_its_item_and_a_skipped_one_loses_it() -> None:
    tree = looped("Int", "1;2;3;4", "RRSKF")
    items = []
    for letter in "RRRRF":
        assert ticks(tree, 1) == letter
        items.append(tree.blackboard.get("item"))
    assert items == [1, 1, 1, 2, 3]
    assert statuses(tree) == "II"


def test_shared_queue_is_used_up_and_may_be_filled_while_it_is() -> None:
    queue = deque([1, 2])
    tree = looped("Int", "{queue}")
    tree.blackboard.set("queue", queue)
    assert ticks(tree, 1) == "R"
    queue.append(3)
    assert ticks(tree, 3) == "RRS"
    assert not queue
    queue.append(4)
    assert ticks(tree, 2) == "RS"
    assert tree.blackboard.get("item") == 4


@pytest.mark.parametrize("value", [[1, 2], (1, 2), "1;2"])
def test_list_or_text_on_the_board_is_copied_once(value: Any) -> None:
    tree = looped("Int", "{queue}")
    tree.blackboard.set("queue", value)
    assert ticks(tree, 3) == "RRS"
    assert tree.blackboard.get("queue") == value
    assert ticks(tree, 1) == "S"


def test_queue_that_makes_no_sense_is_an_error_that_says_so() -> None:
    with pytest.raises(LoadError, match="'x' is not a whole number"):
        looped("Int", "1;x")
    with pytest.raises(LoadError, match="input 'queue' is not given"):
        tree_of(f"<LoopInt value='{{item}}'>{leaf('S')}</LoopInt>")
    tree = looped("Int", "{queue}")
    tree.blackboard.set("queue", 5)
    with pytest.raises(NodeError, match="must be a deque, a list or text, not int"):
        tree.tick_once()
    tree = looped("Int", "{queue}")
    tree.blackboard.set("queue", [0.5])
    with pytest.raises(NodeError, match=r"0\.5 is not a whole number"):
        tree.tick_once()
