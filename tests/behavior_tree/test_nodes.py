"""Nodes and ports of the built-in set that the recorded trees have seldom or not at all."""

import pytest

from behavior_tree import NodeError
from tests.behavior_tree.trees import leaf, statuses, ticks, tree_of


@pytest.mark.parametrize("cases", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("chosen", [0, 1, -1])
def test_switch_ticks_the_child_of_the_equal_case_or_the_last(cases: int, chosen: int) -> None:
    events: list[str] = []
    ports = "".join(f' case_{number}="value{number}"' for number in range(1, cases + 1))
    children = "".join(leaf("S", f"child{number}") for number in range(1, cases + 2))
    tree = tree_of(f'<Switch{cases} variable="{{v}}"{ports}>{children}</Switch{cases}>', events=events)
    number = {0: 1, 1: cases, -1: cases + 1}[chosen]
    tree.blackboard.set("v", f"value{number}")
    assert ticks(tree, 1) == "S"
    assert events == [f"child{number}:S"]


@pytest.mark.parametrize(
    ("value", "case", "equal"),
    [("a", "a", True), (1, "1", True), (1.0, "1", True), (1, "1.0", True), ("1.00", "1", True),
     (2, "GREEN", True), ("GREEN", "2", True), (1, "GREEN", False), ("a", "A", False),
     (0.1, "0.1000001", True), (0.1, "0.1001", False)],
)  # fmt: skip
def test_switch_compares_as_text_as_whole_number_and_as_real(value: object, case: str, equal: bool) -> None:
    tree = tree_of(
        f'<Switch2 variable="{{v}}" case_1="{case}" case_2="none">'
        "<AlwaysSuccess/><AlwaysFailure/><AlwaysFailure/></Switch2>"
    )
    tree.root.runtime.enums["GREEN"] = 2  # type: ignore[index]
    tree.blackboard.set("v", value)
    assert ticks(tree, 1) == ("S" if equal else "F")


def test_switch_without_a_readable_variable_takes_the_default() -> None:
    children = "<AlwaysFailure/><AlwaysFailure/><AlwaysSuccess/>"
    tree = tree_of(f'<Switch2 variable="{{v}}" case_1="1" case_2="2">{children}</Switch2>')
    assert ticks(tree, 1) == "S"


def test_switch_halts_the_child_whose_case_no_longer_holds() -> None:
    events: list[str] = []
    children = leaf("R", "a") + leaf("R", "b") + leaf("R", "c")
    tree = tree_of(f'<Switch2 variable="{{v}}" case_1="1" case_2="2">{children}</Switch2>', events=events)
    tree.blackboard.set("v", "1")
    ticks(tree, 1)
    tree.blackboard.set("v", "2")
    ticks(tree, 1)
    assert events == ["a:R", "a:H", "b:R"]


def test_number_of_cycles_is_read_from_the_board_at_run_time() -> None:
    tree = tree_of(
        "<Sequence><Script code='n := 2'/><Repeat num_cycles='{n}'><Script code='count += 1'/></Repeat></Sequence>"
    )
    tree.blackboard.set("count", 0)
    assert ticks(tree, 2) == "RS"
    assert tree.blackboard.get("count") == 2


def test_failed_attempt_may_change_the_number_of_attempts() -> None:
    tree = tree_of(
        "<RetryUntilSuccessful num_attempts='{n}'><Sequence><Script code='n := n - 1'/><AlwaysFailure/>"
        "</Sequence></RetryUntilSuccessful>"
    )
    tree.blackboard.set("n", 4)
    assert ticks(tree, 2) == "RF"
    assert tree.blackboard.get("n") == 2


def test_endless_loops_do_not_end() -> None:
    assert ticks(tree_of(f"<Repeat num_cycles='-1'>{leaf('S')}</Repeat>"), 50) == "R" * 50
    assert ticks(tree_of(f"<RetryUntilSuccessful num_attempts='-1'>{leaf('F')}</RetryUntilSuccessful>"), 50) == "R" * 50


def test_loop_goes_on_in_the_same_tick_after_a_child_that_took_several() -> None:
    events: list[str] = []
    tree = tree_of(f"<Repeat num_cycles='2'>{leaf('RSRS')}</Repeat>", events=events)
    assert ticks(tree, 3) == "RRS"
    assert events == ["leaf:R", "leaf:S", "leaf:R", "leaf:S"]


def test_parallel_reads_its_thresholds_at_every_tick() -> None:
    tree = tree_of(f"<Parallel success_count='{{n}}'>{leaf('S', 'a')}{leaf('R', 'b')}</Parallel>")
    tree.blackboard.set("n", 2)
    assert ticks(tree, 1) == "R"
    tree.blackboard.set("n", 1)
    assert ticks(tree, 1) == "S"
    tree.blackboard.set("n", 3)
    with pytest.raises(NodeError, match="success_count is 3, more than the 2 children"):
        tree.tick_once()


def test_skipped_condition_is_an_error_that_says_so() -> None:
    for node in ("IfThenElse", "WhileDoElse"):
        tree = tree_of(f"<{node}>{leaf('K', 'asked')}<AlwaysSuccess/></{node}>")
        with pytest.raises(NodeError, match="its condition 'asked' was skipped"):
            tree.tick_once()


def test_stateful_condition_of_a_branch_without_else_repeats_its_failure() -> None:
    events: list[str] = []
    asked = f"<IfThenElse>{leaf('FS', 'asked')}<AlwaysSuccess/></IfThenElse>"
    tree = tree_of(f"<WhileDoElse>{asked}<AlwaysSuccess/>{leaf('R', 'b')}</WhileDoElse>", events=events)
    assert ticks(tree, 3) == "RRR"
    assert events == ["asked:F", "b:R", "b:R", "b:R"]
    assert "repeats its result" in tree.warnings[0]


def test_synchronous_action_must_not_run_on() -> None:
    tree = tree_of('<ScriptedSync name="n" script="R"/>')
    with pytest.raises(NodeError, match="synchronous action and must not return RUNNING"):
        tree.tick_once()


def test_precondition_takes_its_script_from_the_board_and_may_skip() -> None:
    tree = tree_of("<Precondition if='{script}' else='SKIPPED'><AlwaysSuccess/></Precondition>")
    tree.blackboard.set("script", "0")
    assert ticks(tree, 1) == "K"
    tree.blackboard.set("script", "1")
    assert ticks(tree, 1) == "S"


def test_script_may_come_from_the_board() -> None:
    tree = tree_of("<Script code='{program}'/>")
    tree.blackboard.set("program", "x := 1")
    tree.tick_once()
    tree.blackboard.set("program", "x := 2")
    tree.tick_once()
    assert tree.blackboard.get("x") == 2


def test_sequence_with_memory_does_not_repeat_what_succeeded_before_a_failure() -> None:
    events: list[str] = []
    tree = tree_of(
        f"<SequenceWithMemory>{leaf('RS', 'a')}{leaf('RFRS', 'b')}{leaf('S', 'c')}</SequenceWithMemory>",
        events=events,
    )
    assert ticks(tree, 5) == "RRFRS"
    assert events == ["a:R", "a:S", "b:R", "b:F", "b:R", "b:S", "c:S"]
    assert statuses(tree) == "IIII"


def test_decorator_runs_its_child_only_after_the_entry_was_written() -> None:
    for node, unchanged in (("SkipUnlessUpdated", "K"), ("WaitValueUpdate", "R")):
        tree = tree_of(f"<{node} entry='{{v}}'>{leaf('SRS')}</{node}>")
        assert ticks(tree, 1) == unchanged
        tree.blackboard.set("v", 1)
        assert ticks(tree, 2) == "S" + unchanged
        tree.blackboard.set("v", 1)
        assert ticks(tree, 3) == "RS" + unchanged


def test_leaf_tells_whether_the_entry_was_written_since_it_last_looked() -> None:
    tree = tree_of("<WasEntryUpdated entry='v'/>")
    assert ticks(tree, 1) == "F"
    tree.blackboard.set("v", 1)
    assert ticks(tree, 2) == "SF"
