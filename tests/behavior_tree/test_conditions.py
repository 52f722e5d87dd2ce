"""Pre- and post-conditions, and the hooks that may replace a node's work."""

import pytest

from behavior_tree import FAILURE, RUNNING, SUCCESS, NodeError
from tests.behavior_tree.trees import leaf, statuses, ticks, tree_of


@pytest.mark.parametrize(
    ("conditions", "result"),
    [
        ({"_failureIf": "1"}, "F"),
        ({"_successIf": "1"}, "S"),
        ({"_skipIf": "1"}, "K"),
        ({"_while": "0"}, "K"),
        ({"_skipIf": "1", "_successIf": "1", "_failureIf": "1"}, "F"),
        ({"_while": "0", "_skipIf": "1", "_successIf": "1"}, "S"),
        ({"_while": "0", "_skipIf": "0"}, "K"),
        ({"_while": "1", "_skipIf": "0", "_successIf": "0", "_failureIf": "0"}, "R"),
    ],
)
def test_first_condition_that_decides_wins_whatever_the_order_of_attributes(
    conditions: dict[str, str], result: str
) -> None:
    assert ticks(tree_of(leaf("R", **conditions)), 1) == result


def test_conditions_but_while_are_not_asked_again_while_the_node_runs() -> None:
    tree = tree_of(leaf("RRS", _failureIf="x", _successIf="x", _skipIf="x"))
    tree.blackboard.set("x", 0)
    assert ticks(tree, 1) == "R"
    tree.blackboard.set("x", 1)
    assert ticks(tree, 2) == "RS"


def test_while_that_becomes_false_halts_the_node_and_skips_it() -> None:
    events: list[str] = []
    tree = tree_of(leaf("R", "n", _while="go", _onHalted="log := 'halted'", _post="go := 7"), events=events)
    tree.blackboard.set("go", 1)
    assert ticks(tree, 1) == "R"
    tree.blackboard.set("go", 0)
    assert ticks(tree, 2) == "KK"
    assert events == ["n:R", "n:H"]
    assert tree.blackboard.dump() == {"go": 0, "log": "halted"}
    assert statuses(tree) == "I"


def test_while_of_a_control_node_halts_what_runs_below() -> None:
    events: list[str] = []
    tree = tree_of(f"<Sequence _while='go'>{leaf('S', 'a')}{leaf('R', 'b')}</Sequence>", events=events)
    tree.blackboard.set("go", 1)
    ticks(tree, 1)
    tree.blackboard.set("go", 0)
    assert ticks(tree, 1) == "K"
    assert events[-1] == "b:H"
    tree.blackboard.set("go", 1)
    events.clear()
    ticks(tree, 1)
    assert events == ["a:S", "b:R"]


@pytest.mark.parametrize(("script", "log"), [("S", "sp"), ("F", "fp"), ("R", ""), ("K", "")])
def test_post_conditions_run_after_completion_only_the_common_one_last(script: str, log: str) -> None:
    tree = tree_of(leaf(script, _post="log += 'p'", _onSuccess="log += 's'", _onFailure="log += 'f'"))
    tree.blackboard.set("log", "")
    ticks(tree, 1)
    assert tree.blackboard.get("log") == log


def test_post_conditions_run_also_if_a_pre_condition_gave_the_result() -> None:
    tree = tree_of(leaf("R", _successIf="1", _onSuccess="log := 'yes'"))
    ticks(tree, 1)
    assert tree.blackboard.get("log") == "yes"


def test_skipped_node_is_never_stored_as_skipped() -> None:
    tree = tree_of(f"<Sequence>{leaf('K', 'a')}{leaf('K', 'b')}</Sequence>")
    assert ticks(tree, 1) == "K"
    assert statuses(tree) == "RII"


def test_control_node_that_stayed_running_after_a_skip_is_halted_by_its_parent() -> None:
    tree = tree_of(
        f"<ReactiveSequence><Sequence _onHalted='log := 1'>{leaf('K', 'a')}</Sequence>{leaf('R', 'b')}"
        "</ReactiveSequence>"
    )
    ticks(tree, 1)
    assert tree.blackboard.get("log") == 1


def test_failing_script_names_the_node_it_belongs_to() -> None:
    tree = tree_of(f"<Sequence>{leaf('S', 'guilty', _post='x = 1')}</Sequence>")
    with pytest.raises(NodeError, match="node 'guilty' of type Scripted failed while it was ticked") as caught:
        tree.tick_once()
    assert caught.value.node == "guilty"
    assert caught.value.line == 1


def test_hook_before_the_tick_replaces_the_work_and_passes_the_post_conditions() -> None:
    events: list[str] = []
    tree = tree_of(leaf("R", "n", _onFailure="log := 'failed'"), events=events)
    tree.root.set_hooks(pre_tick=lambda node: FAILURE)
    assert ticks(tree, 1) == "F"
    assert not events
    assert tree.blackboard.get("log") == "failed"
    tree.root.set_hooks()
    assert ticks(tree, 1) == "R"


def test_hook_before_the_tick_that_returns_nothing_or_running_only_watches() -> None:
    tree = tree_of(leaf("S"))
    tree.root.set_hooks(pre_tick=lambda node: RUNNING)
    assert ticks(tree, 1) == "S"
    tree.root.set_hooks(pre_tick=lambda node: None)
    assert ticks(tree, 1) == "S"


def test_hook_before_the_tick_is_not_asked_about_a_completed_node() -> None:
    asked: list[str] = []
    tree = tree_of(f"<ReactiveSequence>{leaf('S', 'a')}{leaf('R', 'b')}</ReactiveSequence>")
    tree.node("b").set_hooks(pre_tick=lambda node: asked.append(node.name))
    tree.node("a").set_hooks(pre_tick=lambda node: asked.append(node.name))
    ticks(tree, 2)
    assert asked == ["a", "b", "a", "b"]
    parallel = tree_of(f"<IfThenElse>{leaf('F', 'a')}{leaf('R', 'b')}</IfThenElse>")
    ticks(parallel, 1)
    parallel.node("a").set_hooks(pre_tick=lambda node: SUCCESS)
    assert ticks(parallel, 1) == "F"


def test_hook_after_the_tick_replaces_the_result_behind_the_post_conditions() -> None:
    tree = tree_of(leaf("S", _onSuccess="log := 'success'", _onFailure="log := 'failure'"))
    tree.root.set_hooks(post_tick=lambda node, status: FAILURE if status == SUCCESS else None)
    assert ticks(tree, 1) == "F"
    assert tree.blackboard.get("log") == "success"
