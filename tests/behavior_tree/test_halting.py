"""What a halt does, and where it deliberately differs from BehaviorTree.CPP."""

import pytest

from behavior_tree import RUNNING, NodeError
from tests.behavior_tree.trees import leaf, statuses, ticks, tree_of


def test_on_halted_runs_once_and_only_for_nodes_that_were_running() -> None:
    tree = tree_of(
        '<Sequence _onHalted="root := root + 1">'
        f"{leaf('S', 'done', _onHalted='done := 1')}{leaf('R', 'busy', _onHalted='busy := busy + 1')}"
        f"{leaf('R', 'later', _onHalted='later := 1')}</Sequence>"
    )
    tree.blackboard.set("root", 0)
    tree.blackboard.set("busy", 0)
    tree.tick_once()
    tree.halt_tree()
    assert tree.blackboard.dump() == {"root": 1, "busy": 1}
    assert statuses(tree) == "IIII"


def test_halted_leaf_gives_up_before_its_script_runs() -> None:
    events: list[str] = []
    tree = tree_of(leaf("R", "n", _onHalted="log := 'halted'"), events=events)
    tree.tick_once()
    tree.halt_tree()
    assert events == ["n:R", "n:H"]
    assert tree.blackboard.get("log") == "halted"


def test_halting_an_idle_tree_does_nothing() -> None:
    events: list[str] = []
    tree = tree_of(leaf("R", "n", _onHalted="x := 1"), events=events)
    tree.halt_tree()
    assert not events
    assert not tree.blackboard.dump()


def test_failing_on_halted_is_reported_after_everything_is_halted() -> None:
    events: list[str] = []
    tree = tree_of(
        '<Parallel _onHalted="root := 1">'
        + leaf("R", "a", _onHalted="missing = 1")
        + leaf("R", "b", _onHalted="alsomissing = 1")
        + leaf("R", "c")
        + "</Parallel>",
        events=events,
    )
    tree.tick_once()
    events.clear()
    with pytest.raises(NodeError, match="'missing'") as caught:
        tree.halt_tree()
    assert caught.value.node == "a"
    assert "alsomissing" in "".join(caught.value.__notes__)
    assert events == ["a:H", "b:H", "c:H"]
    assert statuses(tree) == "IIII"
    assert tree.blackboard.get("root") == 1


def test_tree_that_was_halted_after_an_error_runs_again() -> None:
    tree = tree_of(f"<Sequence>{leaf('S', 'a')}<Script code='x = 1'/></Sequence>")
    with pytest.raises(NodeError):
        tree.tick_once()
    tree.halt_tree()
    tree.blackboard.set("x", 0)
    assert ticks(tree, 1) == "S"


def test_sequence_with_memory_goes_on_where_it_was_halted() -> None:
    events: list[str] = []
    tree = tree_of(f"<SequenceWithMemory>{leaf('RS', 'a')}{leaf('RRS', 'b')}</SequenceWithMemory>", events=events)
    assert ticks(tree, 2) == "RR"
    tree.halt_tree()
    events.clear()
    assert ticks(tree, 2) == "RS"
    assert events == ["b:R", "b:S"]


def test_sequence_begins_anew_after_a_halt() -> None:
    events: list[str] = []
    tree = tree_of(f"<Sequence>{leaf('S', 'a')}{leaf('RS', 'b')}</Sequence>", events=events)
    ticks(tree, 1)
    tree.halt_tree()
    events.clear()
    ticks(tree, 1)
    assert events == ["a:S", "b:S"]


def test_run_once_is_not_rearmed_by_a_halt() -> None:
    tree = tree_of(f'<Parallel><RunOnce then_skip="false">{leaf("SF")}</RunOnce>{leaf("R", "b")}</Parallel>')
    ticks(tree, 1)
    tree.halt_tree()
    assert tree.tick_exactly_once() == RUNNING
    assert statuses(tree) == "RSIR"


def test_precondition_that_was_found_true_stays_so_over_a_halt() -> None:
    tree = tree_of(f'<Precondition if="go" else="FAILURE">{leaf("RRS")}</Precondition>')
    tree.blackboard.set("go", 1)
    ticks(tree, 1)
    tree.halt_tree()
    tree.blackboard.set("go", 0)
    assert ticks(tree, 3) == "RSF"


def test_try_catch_cleans_up_when_halted_if_asked_to() -> None:
    for asked, expected in (("true", ["a:H", "c:R", "c:H"]), ("false", ["a:H"])):
        events: list[str] = []
        tree = tree_of(f'<TryCatch catch_on_halt="{asked}">{leaf("R", "a")}{leaf("R", "c")}</TryCatch>', events=events)
        ticks(tree, 1)
        events.clear()
        tree.halt_tree()
        assert events == expected
        assert statuses(tree) == "III"


def test_leaf_that_fails_to_give_up_does_not_keep_others_from_it() -> None:
    events: list[str] = []
    tree = tree_of(f"<Parallel>{leaf('R', 'a')}<Sequence>{leaf('R', 'b')}</Sequence></Parallel>", events=events)
    tree.tick_once()

    def refuse() -> None:
        raise OSError("gripper does not answer")

    tree.node("a").on_halted = refuse  # type: ignore[attr-defined]
    with pytest.raises(NodeError, match="gripper does not answer"):
        tree.halt_tree()
    assert events[-1] == "b:H"
    assert statuses(tree) == "IIII"
