"""One table for every node type: what a few ticks give, which leaves are ticked and halted, and what stays stored.

Each row is also true of BehaviorTree.CPP. Leaves are called a, b, c, …; ``a=SF`` is a stateful action, ``a?SF`` a
condition, ``a!SF`` a synchronous action, which return their letters one after the other.
"""

import re

import pytest

from behavior_tree import BlackboardError, ManualClock, NodeError, Registry
from tests.behavior_tree.trees import statuses, ticks, tree_of

_LEAF = re.compile(r"(\w)([=?!])([RSFK]+)")
_TYPES = {"=": "Scripted", "?": "ScriptedCond", "!": "ScriptedSync"}


def xml(text: str) -> str:
    """Return XML with the leaves spelt out."""
    return _LEAF.sub(lambda found: f'<{_TYPES[found[2]]} name="{found[1]}" script="{found[3]}"/>', text)


def node(type_id: str, leaves: str, ports: str = "") -> str:
    return xml(f"{leaves.join((f'<{type_id} {ports}>', f'</{type_id}>'))}").replace("> <", "><")


SEQUENCES = [
    ("Sequence", "a=S b=RS c=S", "", "RS", "a:S b:R b:S c:S"),
    ("Sequence", "a=S b=F c=S", "", "FF", "a:S b:F a:S b:F"),
    ("Sequence", "a=K b=K", "", "K", "a:K b:K"),
    ("Sequence", "a=K b=S", "", "S", "a:K b:S"),
    ("Sequence", "a=S b=RK c=K", "", "RS", "a:S b:R b:K c:K b:H"),
    ("Fallback", "a=F b=RF c=S", "", "RS", "a:F b:R b:F c:S"),
    ("Fallback", "a=F b=F", "", "F", "a:F b:F"),
    ("Fallback", "a=K b=F", "", "F", "a:K b:F"),
    ("Fallback", "a=K b=K", "", "K", "a:K b:K"),
    ("AsyncSequence", "a!S b!S c!S", "", "RRS", "a:S b:S c:S"),
    ("AsyncSequence", "a=RS b=S", "", "RS", "a:R a:S b:S"),
    ("AsyncSequence", "a!S b!F", "", "RF", "a:S b:F"),
    ("AsyncSequence", "a!K b!S", "", "S", "a:K b:S"),
    ("AsyncFallback", "a!F b!F c!S", "", "RRS", "a:F b:F c:S"),
    ("AsyncFallback", "a=RF b=F", "", "RF", "a:R a:F b:F"),
    ("SequenceWithMemory", "a!S b!S", "", "RS", "a:S b:S"),
    ("SequenceWithMemory", "a=S b=FS c=S", "", "RFRS", "a:S b:F b:S c:S"),
    ("SequenceWithMemory", "a=S b=SF", "", "RSR", "a:S b:S a:S"),
    ("ReactiveSequence", "a?S b=RS c=S", "", "RS", "a:S b:R a:S b:S c:S"),
    ("ReactiveSequence", "a?SF b=R", "", "RF", "a:S b:R a:F b:H"),
    ("ReactiveSequence", "a=SR b=R c=R", "", "RR", "a:S b:R a:R b:H"),
    ("ReactiveSequence", "a?SR b=R", "", "RR", "a:S b:R a:R b:H"),
    ("ReactiveSequence", "a=RK b=S", "", "RS", "a:R a:K a:H b:S"),
    ("ReactiveSequence", "a=K b=K", "", "K", "a:K b:K"),
    ("ReactiveFallback", "a?F b=RF c=F", "", "RF", "a:F b:R a:F b:F c:F"),
    ("ReactiveFallback", "a?FS b=R", "", "RS", "a:F b:R a:S b:H"),
    ("ReactiveFallback", "a=K b=K", "", "K", "a:K b:K"),
    ("ReactiveFallback", "a=K b=F", "", "F", "a:K b:F"),
]  # fmt: skip
PARALLELS = [
    ("Parallel", "a=S b=RS c=S", "", "RS", "a:S b:R c:S b:S"),
    ("Parallel", "a=R b=F c=S", "", "F", "a:R b:F a:H"),
    ("Parallel", "a=R b=S c=S", 'success_count="2"', "S", "a:R b:S c:S a:H"),
    ("Parallel", "a=R b=S c=S", 'success_count="-2"', "S", "a:R b:S c:S a:H"),
    ("Parallel", "a=F b=F c=R", 'failure_count="2" success_count="1"', "F", "a:F b:F"),
    ("Parallel", "a=F b=F c=S", 'failure_count="-1" success_count="1"', "S", "a:F b:F c:S"),
    ("Parallel", "a=F b=S", 'success_count="0"', "S", "a:F"),
    ("Parallel", "a=R b=S", 'failure_count="0"', "F", "a:R a:H"),
    ("Parallel", "a=S b=S", 'failure_count="0" success_count="1"', "S", "a:S"),
    ("Parallel", "a=K b=S", "", "S", "a:K b:S"),
    ("Parallel", "a=KS b=S", 'success_count="2"', "RS", "a:K b:S a:S"),
    ("Parallel", "a=K b=K", 'success_count="2"', "KK", "a:K b:K a:K b:K"),
    ("Parallel", "a=K b=K", "", "S", "a:K b:K"),
    ("Parallel", "a=F b=R c=R", 'failure_count="3"', "F", "a:F"),
    ("ParallelAll", "a=F b=RS", "", "RF", "a:F b:R b:S"),
    ("ParallelAll", "a=F b=RS", 'max_failures="2"', "RS", "a:F b:R b:S"),
    ("ParallelAll", "a=F b=F", 'max_failures="-1"', "F", "a:F b:F"),
    ("ParallelAll", "a=S b=S", 'max_failures="0"', "F", "a:S b:S"),
    ("ParallelAll", "a=K b=S", "", "S", "a:K b:S"),
    ("ParallelAll", "a=KS b=RS", "", "RS", "a:K b:R a:S b:S"),
    ("ParallelAll", "a=K b=K", "", "K", "a:K b:K"),
]  # fmt: skip
BRANCHES = [
    ("IfThenElse", "a=S b=RS c=S", "", "RS", "a:S b:R b:S"),
    ("IfThenElse", "a=F b=S c=RF", "", "RF", "a:F c:R c:F"),
    ("IfThenElse", "a=RF b=S", "", "RFF", "a:R a:F"),
    ("IfThenElse", "a?F b=S", "", "FF", "a:F a:F"),
    ("IfThenElse", "a=S b=K", "", "KK", "a:S b:K a:S b:K"),
    ("WhileDoElse", "a?SSF b=R c=R", "", "RRR", "a:S b:R a:S b:R a:F b:H c:R"),
    ("WhileDoElse", "a?SF b=R", "", "RF", "a:S b:R a:F b:H"),
    ("WhileDoElse", "a?RS b=S", "", "RS", "a:R a:S b:S"),
    ("WhileDoElse", "a=SF b=RS c=S", "", "RS", "a:S b:R b:S"),
    ("WhileDoElse", "a?S b=K c=S", "", "KK", "a:S b:K a:S b:K"),
    ("TryCatch", "a=S b=S c=S", "", "S", "a:S b:S"),
    ("TryCatch", "a=S b=F c=RS", "", "RF", "a:S b:F c:R c:S"),
    ("TryCatch", "a=F b=F", "", "F", "a:F b:F"),
    ("TryCatch", "a=K b=K c=S", "", "K", "a:K b:K"),
    ("TryCatch", "a=K b=S c=S", "", "S", "a:K b:S"),
    ("TryCatch", "a=F b=K", "", "F", "a:F b:K"),
    ("Switch2", "a=S b=S c=S", 'variable="2" case_1="1" case_2="2"', "S", "b:S"),
    ("Switch2", "a=K b=S c=S", 'variable="1" case_1="1" case_2="2"', "KK", "a:K a:K"),
    ("Switch3", "a=S b=S c=RF d=S", 'variable="x" case_1="1" case_2="2" case_3="x"', "RF", "c:R c:F"),
    ("Switch3", "a=S b=S c=S d=F", 'variable="y" case_1="1" case_2="2"', "F", "d:F"),
]  # fmt: skip
DECORATORS = [
    ("Inverter", "a=RSFK", "", "RFSK", "a:R a:S a:F a:K"),
    ("ForceSuccess", "a=RSFK", "", "RSSK", "a:R a:S a:F a:K"),
    ("ForceFailure", "a=RSFK", "", "RFFK", "a:R a:S a:F a:K"),
    ("KeepRunningUntilFailure", "a=RSKF", "", "RRRF", "a:R a:S a:K a:F"),
    ("Repeat", "a!S", 'num_cycles="3"', "RRS", "a:S a:S a:S"),
    ("Repeat", "a=RSSRS", 'num_cycles="3"', "RRRS", "a:R a:S a:S a:R a:S"),
    ("Repeat", "a=SF", 'num_cycles="3"', "RFRF", "a:S a:F a:S a:F"),
    ("Repeat", "a!S", 'num_cycles="0"', "S", ""),
    ("Repeat", "a!SKS", 'num_cycles="2"', "RKS", "a:S a:K a:S"),
    ("RetryUntilSuccessful", "a!FFS", 'num_attempts="3"', "RRS", "a:F a:F a:S"),
    ("RetryUntilSuccessful", "a!F", 'num_attempts="2"', "RF", "a:F a:F"),
    ("RetryUntilSuccessful", "a=RFRS", 'num_attempts="2"', "RRS", "a:R a:F a:R a:S"),
    ("RetryUntilSuccessful", "a!F", 'num_attempts="0"', "F", ""),
    ("RetryUntilSuccessful", "a!FKF", 'num_attempts="2"', "RKF", "a:F a:K a:F"),
    ("RunOnce", "a=RFS", "", "RFKK", "a:R a:F"),
    ("RunOnce", "a=KSF", 'then_skip="false"', "KSSS", "a:K a:S"),
    ("Precondition", "a=RS", 'if="1"', "RS", "a:R a:S"),
    ("Precondition", "a=S", 'if="0"', "F", ""),
    ("Precondition", "a=S", 'if="0" else="RUNNING"', "R", ""),
    ("Precondition", "a=S", 'if="0" else="SKIPPED"', "K", ""),
    ("Precondition", "a=S", 'if="0" else="SUCCESS"', "S", ""),
    ("SkipUnlessUpdated", "a=S", 'entry="{never}"', "K", ""),
    ("WaitValueUpdate", "a=S", 'entry="never"', "R", ""),
]  # fmt: skip


@pytest.mark.parametrize(
    ("type_id", "leaves", "ports", "results", "expected"), [*SEQUENCES, *PARALLELS, *BRANCHES, *DECORATORS]
)
def test_node_does_what_its_row_says(type_id: str, leaves: str, ports: str, results: str, expected: str) -> None:
    events: list[str] = []
    tree = tree_of(node(type_id, leaves, ports), events=events)
    assert ticks(tree, len(results)) == results
    assert " ".join(events) == expected


@pytest.mark.parametrize(
    ("body", "number", "stored"),
    [
        ("<Sequence>a=K b=K</Sequence>", 1, "RII"),
        ("<ReactiveSequence>a=S b=R</ReactiveSequence>", 1, "RIR"),
        ("<ReactiveSequence>a?S b=K c=R</ReactiveSequence>", 1, "RIIR"),
        ("<Parallel>a=S b=R c=K</Parallel>", 1, "RSRI"),
        ("<Sequence>a=S b=R</Sequence>", 1, "RSR"),
        ("<SequenceWithMemory>a=S b=F c=S</SequenceWithMemory>", 2, "ISII"),
        ("<Sequence><IfThenElse>a=S b=R</IfThenElse></Sequence>", 1, "RRSR"),
        ("<IfThenElse>a=F b=S</IfThenElse>", 1, "IFI"),
        ("<Sequence><Switch2 variable='1' case_1='1' case_2='2'>a=K b=S c=S</Switch2>d=R</Sequence>", 1, "RIIIIR"),
        ("<Sequence><Inverter>a=K</Inverter>b=R</Sequence>", 1, "RRIR"),
        ("<Sequence><Inverter>a=F</Inverter>b=R</Sequence>", 1, "RSIR"),
        ("<Sequence><Repeat num_cycles='2'>a=SK</Repeat>b=R</Sequence>", 2, "RRIR"),
        ("<Sequence><Precondition if='0' else='SKIPPED'>a=S</Precondition>b=R</Sequence>", 1, "RIIR"),
        ("<Sequence><RunOnce>a=S</RunOnce>b=RS</Sequence>", 1, "RSIR"),
    ],
)
def test_statuses_stay_stored_as_the_rows_say(body: str, number: int, stored: str) -> None:
    tree = tree_of(xml(body))
    ticks(tree, number)
    assert statuses(tree) == stored


@pytest.mark.parametrize(
    ("body", "exact"),
    [
        ("<AsyncSequence>a!S b!S c!S</AsyncSequence>", 3),
        ("<AsyncFallback>a!F b!F c!S</AsyncFallback>", 3),
        ("<SequenceWithMemory>a!S b!S c!S</SequenceWithMemory>", 3),
        ("<Repeat num_cycles='4'>a!S</Repeat>", 4),
        ("<RetryUntilSuccessful num_attempts='4'>a!FFFS</RetryUntilSuccessful>", 4),
        ("<Sequence>a!S b!S</Sequence>", 1),
    ],
)
def test_synchronous_steps_take_several_ticks_of_the_root_but_one_of_the_tree(body: str, exact: int) -> None:
    assert ticks(tree_of(xml(body)), exact) == "R" * (exact - 1) + "S"
    assert tree_of(xml(body)).tick_once() == 2


def test_root_that_was_skipped_keeps_what_is_stored() -> None:
    tree = tree_of(xml("<Sequence>a=KR</Sequence>"))
    assert ticks(tree, 1) == "K"
    assert statuses(tree) == "RI"


@pytest.mark.parametrize(
    "condition",
    [
        "<Sequence><AlwaysSuccess _skipIf='true'/>a?FS</Sequence>",
        "<Fallback>a=K b?SF</Fallback>",
        "<AsyncSequence>a=K b!FS</AsyncSequence>",
        "<SequenceWithMemory>a=K b=FK</SequenceWithMemory>",
        "<TryCatch>a=K b?FS c=S</TryCatch>",
    ],
)
def test_skipped_children_are_counted_on_while_nobody_resets_the_node(condition: str) -> None:
    tree = tree_of(xml(f"<WhileDoElse>{condition}d=R e=R</WhileDoElse>"))
    assert ticks(tree, 1) == "R"
    with pytest.raises(NodeError, match="was skipped"):
        tree.tick_exactly_once()


@pytest.mark.parametrize(("branching", "stored"), [("WhileDoElse", "RIII"), ("IfThenElse", "RRII")])
def test_error_of_a_skipped_condition_leaves_behind_what_btcpp_leaves(branching: str, stored: str) -> None:
    tree = tree_of(xml(f"<{branching}><Sequence>a=K</Sequence>b=R</{branching}>"))
    with pytest.raises(NodeError, match="was skipped"):
        tree.tick_exactly_once()
    assert statuses(tree) == stored


def test_skipped_children_are_forgotten_once_the_node_is_reset() -> None:
    inner = "<SequenceWithMemory>a=K b=RK</SequenceWithMemory>"
    tree = tree_of(xml(f"<ReactiveSequence>q?SFS{inner}</ReactiveSequence>"))
    assert ticks(tree, 3) == "RFS"
    tree = tree_of(xml("<Fallback><Sequence>a=K b?FS</Sequence>c=S</Fallback>"))
    assert ticks(tree, 2) == "SS"


@pytest.mark.parametrize("condition", ["_skipIf", "_failureIf", "_successIf"])
def test_condition_is_asked_again_at_every_tick_until_the_node_starts(condition: str) -> None:
    letter = {"_skipIf": "K", "_failureIf": "F", "_successIf": "S"}[condition]
    tree = tree_of(f"<Scripted name='n' script='RRS' {condition}='x &lt; 2' _onHalted='h := 1'/>")
    seen = ""
    for value in (0, 1, 2, 0, 0, 0):
        tree.blackboard.set("x", value)
        seen += ticks(tree, 1)
    assert seen == f"{letter}{letter}RRS{letter}"


@pytest.mark.parametrize("parent", ["Sequence", "ReactiveSequence", "Fallback", "Inverter", "SequenceWithMemory"])
def test_while_is_asked_at_every_tick_whatever_the_parent(parent: str) -> None:
    events: list[str] = []
    leaf = "<Scripted name='n' script='R' _while='go' _onHalted='h += 1' _post='p := 1'/>"
    tree = tree_of(f"<{parent}>{leaf}</{parent}>", events=events)
    tree.blackboard.set("h", 0)
    results = ""
    for go in (0, 1, 1, 0, 0, 1):
        tree.blackboard.set("go", go)
        results += ticks(tree, 1)
    assert results == "KRRKKR"
    assert events == ["n:R", "n:R", "n:H", "n:R"]
    assert tree.blackboard.dump() == {"h": 1, "go": 1}


def test_child_that_completed_is_reset_without_its_halt_script() -> None:
    tree = tree_of(
        "<Sequence><Scripted name='a' script='S' _onHalted='x := 1'/>"
        "<Scripted name='b' script='RS' _onHalted='y := 1'/></Sequence>"
    )
    assert ticks(tree, 2) == "RS"
    assert not tree.blackboard.dump()


@pytest.mark.parametrize(
    ("body", "events"),
    [
        ("<ReactiveSequence>a?SF b=R</ReactiveSequence>", "b:H"),
        ("<ReactiveFallback>a?FS b=R</ReactiveFallback>", "b:H"),
        ("<Parallel>a?SF b=R c=R</Parallel>", ""),
        ("<Parallel success_count='1'>b=R a=RS c=R</Parallel>", "b:H"),
        ("<WhileDoElse>a?SF b=R c=S</WhileDoElse>", "b:H"),
    ],
)
def test_node_that_its_parent_halts_runs_its_halt_script(body: str, events: str) -> None:
    log: list[str] = []
    tree = tree_of(xml(body).replace('name="b"', 'name="b" _onHalted="h := 1"'), events=log)
    ticks(tree, 2)
    assert [event for event in log if event == "b:H"] == events.split()
    assert tree.blackboard.dump() == ({"h": 1} if events else {})


def test_halted_loops_count_anew() -> None:
    for body in (
        "<Repeat num_cycles='2'>a=SRSS</Repeat>",
        "<RetryUntilSuccessful num_attempts='2'>a=FRFF</RetryUntilSuccessful>",
    ):
        tree = tree_of(xml(body))
        assert ticks(tree, 2) == "RR"
        tree.halt_tree()
        assert ticks(tree, 1) == "R"
        assert ticks(tree, 1) in "SF"


def test_precondition_that_was_found_true_stays_so_over_a_skip() -> None:
    tree = tree_of(xml("<Precondition if='go'>a=KS</Precondition>"))
    tree.blackboard.set("go", 1)
    assert ticks(tree, 1) == "K"
    tree.blackboard.set("go", 0)
    assert ticks(tree, 2) == "SF"


@pytest.mark.parametrize("halted_in", [1, 2, 3])
def test_sequence_with_memory_in_a_reactive_parent_keeps_its_place_when_it_is_halted(halted_in: int) -> None:
    answers = "S" * halted_in + "F" + "S" * 3
    events: list[str] = []
    body = f"<ReactiveSequence>q?{answers}<SequenceWithMemory>a=S b=RR c=R</SequenceWithMemory></ReactiveSequence>"
    tree = tree_of(xml(body), events=events)
    ticks(tree, halted_in)
    assert ticks(tree, 1) == "F"
    events.clear()
    ticks(tree, 1)
    assert events == ["q:S", "b:R"]


@pytest.mark.parametrize("catch", ["true", "false"])
def test_try_catch_that_is_halted_while_catching_only_halts(catch: str) -> None:
    events: list[str] = []
    tree = tree_of(node("TryCatch", "a=F b=R", f'catch_on_halt="{catch}"'), events=events)
    ticks(tree, 1)
    tree.halt_tree()
    assert events == ["a:F", "b:R", "b:H"]


@pytest.mark.parametrize(("text", "entry"), [("7", 7), ("7.5", None), ("x", None)])
def test_set_blackboard_converts_text_to_the_type_of_the_entry(text: str, entry: int | None) -> None:
    tree = tree_of(f"<SetBlackboard value='{text}' output_key='n'/>")
    tree.blackboard.set("n", 1)
    if entry is None:
        with pytest.raises(NodeError, match="blackboard entry 'n' is of type int"):
            tree.tick_once()
    else:
        tree.tick_once()
        assert tree.blackboard.get("n") == entry


def test_set_blackboard_copies_the_type_and_needs_its_source() -> None:
    tree = tree_of("<SetBlackboard value='{r}' output_key='copy'/>")
    tree.blackboard.set("r", 2.0)
    tree.tick_once()
    assert tree.blackboard.dump() == {"r": 2.0, "copy": 2.0}
    with pytest.raises(BlackboardError, match="is of type float"):
        tree.blackboard.set("copy", "word")
    tree.blackboard.unset("r")
    with pytest.raises(NodeError, match="there is no blackboard entry 'r'"):
        tree.tick_once()


def test_conditions_are_asked_anew_and_actions_repeat_their_result_until_they_are_reset() -> None:
    events: list[str] = []
    tree = tree_of(xml("<WhileDoElse>a=S b=R</WhileDoElse>"), events=events)
    ticks(tree, 2)
    assert events == ["a:S", "b:R", "b:R"]
    for answer in ("a?S", "a!S"):
        events.clear()
        tree = tree_of(xml(f"<WhileDoElse>{answer} b=R</WhileDoElse>"), events=events)
        ticks(tree, 2)
        assert events == ["a:S", "b:R", "a:S", "b:R"]


@pytest.mark.parametrize(("first", "second", "total"), [("0.5", "0.5", 1.0), ("0.1", "0.2", 0.1 + 0.2), ("1", "1", 2)])
def test_number_on_the_board_keeps_the_type_of_its_first_value(first: str, second: str, total: float) -> None:
    tree = tree_of(f"<Script code='r := {first}; r += {second}'/>")
    tree.tick_once()
    value = tree.blackboard.get("r")
    assert (type(value), value) == (type(total), total)


def test_all_built_in_types_of_behaviortree_cpp_are_there() -> None:
    manifests = Registry().manifests
    kinds = [manifest.kind.value for manifest in manifests.values()]
    assert len(manifests) == 42
    assert [kinds.count(kind) for kind in ("Control", "Decorator", "SubTree")] == [17, 16, 1]
    assert kinds.count("Action") + kinds.count("Condition") == 8
    assert "ManualSelector" not in manifests


def test_timeout_in_a_loop_measures_each_round() -> None:
    clock = ManualClock()
    timeout = "<Timeout msec='100'><Sleep msec='150'/></Timeout>"
    tree = tree_of(f"<RetryUntilSuccessful num_attempts='2'>{timeout}</RetryUntilSuccessful>", clock=clock)
    steps = 0
    while tree.tick_once() == 1:
        clock.advance_to(tree.next_wake_up() or clock.now())
        steps += 1
    assert (round(clock.now(), 6), steps) == (0.2, 2)


def test_delay_inside_a_parallel_does_not_hold_the_others_up() -> None:
    clock, events = ManualClock(), list[str]()
    tree = tree_of(xml("<Parallel><Delay delay_msec='50'>a=S</Delay>b=RS</Parallel>"), clock=clock, events=events)
    assert ticks(tree, 2) == "RR"
    clock.advance(0.05)
    assert ticks(tree, 1) == "S"
    assert events == ["b:R", "b:S", "a:S"]
