"""No tree, however odd, hangs, leaves a leaf running after a halt, or raises anything but the engine's errors."""

from contextlib import suppress
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behavior_tree import IDLE, RUNNING, LoadError, ManualClock, NodeError, Registry, Tree, TreeError, load_text
from behavior_tree.nav2 import register_nav2
from behavior_tree.scripted import scripted_registry
from tests.behavior_tree.random_trees import TreeMaker
from tests.behavior_tree.trees import document, plain_registry

LEAF = "<AlwaysSuccess/>"
VALUES = (0, 1, -3, 2.5, "x", "1;2", [1.0, 2.0], {"x": 1, "y": 2})


def loaded(text: str, events: list[str], clock: ManualClock) -> Tree | None:
    """Return a tree, or None if it is refused as it should be."""
    registry = scripted_registry(events)
    register_nav2(registry)
    try:
        return load_text(text, registry, clock=clock)
    except LoadError as error:
        assert error.line >= 1
        assert error.node
        return None


def halt(tree: Tree, events: list[str]) -> None:
    """Halt a tree; every action that was running has to know of it."""
    running = [node.name for node in tree.nodes if node.status == RUNNING and node.type_id == "Scripted"]
    events.clear()
    with suppress(NodeError):  # A script failed; all are halted nevertheless.
        tree.halt_tree()
    assert {f"{name}:H" for name in running} <= set(events)
    assert {node.status for node in tree.nodes} == {IDLE}
    earliest = tree.root.runtime.timers.earliest()
    assert earliest is None, "a timer outlived the halt"


def torture(text: str, random: Random) -> None:
    events: list[str] = []
    clock = ManualClock()
    tree = loaded(text, events, clock)
    if tree is None:
        return
    for _ in range(10):
        choice = random.randrange(8)
        try:
            if choice < 3:
                tree.tick_exactly_once()
            elif choice < 5:
                tree.tick_once(max_ticks=40)
            elif choice == 5:
                clock.advance(0.06)
            elif choice == 6:
                key = ("a", "queue", "goal", "robot_pose", "path", "run_id")[random.randrange(6)]
                tree.blackboard.set(key, VALUES[random.randrange(len(VALUES))])
            else:
                halt(tree, events)
        except NodeError:
            halt(tree, events)
        except TreeError:
            assert choice == 6  # The value does not fit the entry.
    halt(tree, events)


@given(st.randoms(use_true_random=False))
@settings(max_examples=150)
def test_no_tree_of_whatever_kind_misbehaves(random: Random) -> None:
    torture(TreeMaker(random, everything=True).document(random.randrange(1, 5)), random)


@pytest.mark.parametrize("part", range(4))
def test_no_large_tree_misbehaves(part: int) -> None:
    for seed in range(part, 240, 4):
        random = Random(seed)
        torture(TreeMaker(random, everything=seed % 3 > 0).document(5), random)


@given(st.text(max_size=60))
def test_any_text_is_a_tree_or_refused_with_a_line(text: str) -> None:
    for whole in (text, f"<root>{text}</root>", document(text)):
        try:
            load_text(whole, plain_registry())
        except LoadError as error:
            assert error.line >= 1


@given(st.randoms(use_true_random=False), st.booleans())
@settings(max_examples=150)
def test_damaged_document_is_a_tree_or_refused_with_a_line(random: Random, lenient: bool) -> None:
    text = TreeMaker(random, everything=True).document(2)
    for _ in range(random.randrange(1, 4)):
        begin = random.randrange(len(text))
        end = begin + random.randrange(12)
        text = (
            text[:begin]
            + ("", '"', "<", "</", "&", "{", "\x00", "<!--", "-->", "\ud800", "é")[random.randrange(11)]
            + text[end:]
        )
    try:
        load_text(text, plain_registry(), lenient=lenient, mock_unknown=lenient)
    except LoadError as error:
        assert error.line >= 1
        assert str(error).startswith("<text>:")


@given(st.text(alphabet="ab01.'+-*/=:;?!&|^~<>() \n{}@\"", max_size=30))
def test_any_script_compiles_or_is_refused_with_the_line_and_the_node(script: str) -> None:
    escaped = script.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    for body in (f'<Script name="n" code="{escaped}"/>', f'<AlwaysSuccess name="n" _skipIf="{escaped}"/>'):
        try:
            tree = load_text(document("\n" + body), Registry(), clock=ManualClock())
        except LoadError as error:
            assert (error.line, error.node) == (2, "n")
            continue
        try:
            tree.tick_exactly_once()
        except NodeError as error:
            assert (error.line, error.node) == (2, "n")


@pytest.mark.parametrize(
    "text",
    ["\x00", "\ud800", '<?xml version="1.0" encoding="nonsense"?><root/>', "<root>" + "<a>" * 10_000,
     "<root a='1' a='2'/>", "<root/><root/>",
     "<?xml version='9'?><root/>", "&undefined;", "<root><BehaviorTree ID='&#0;'/></root>"],
)  # fmt: skip
def test_document_that_no_parser_takes_is_a_load_error_with_a_line(text: str) -> None:
    with pytest.raises(LoadError) as caught:
        load_text(text, Registry())
    assert caught.value.line >= 1


def test_sub_trees_that_multiply_are_refused_before_they_fill_the_memory() -> None:
    trees = [
        f"<BehaviorTree ID='T{level}'><Sequence><SubTree ID='T{level + 1}'/><SubTree ID='T{level + 1}'/></Sequence>"
        "</BehaviorTree>"
        for level in range(40)
    ]
    text = document("<SubTree ID='T0'/>", *trees, f"<BehaviorTree ID='T40'>{LEAF}</BehaviorTree>")
    with pytest.raises(LoadError, match=r"more than \d+ nodes"):
        load_text(text, Registry())


def nested_trees(count: int, last: str, wrapped: str = "{}") -> Tree:
    """Load trees each of which uses the next, the last of them with a body of its own."""
    uses = [wrapped.format(f'<SubTree ID="T{n + 1}" name="s" a="{{a}}"/>') for n in range(count)]
    trees = "".join(f'<BehaviorTree ID="T{n}">{body}</BehaviorTree>' for n, body in enumerate([*uses, last]))
    text = f'<root BTCPP_format="4" main_tree_to_execute="T0">{trees}</root>'
    return load_text(text, plain_registry(), clock=ManualClock())


def test_hundreds_of_nested_sub_trees_run_and_are_halted() -> None:
    last = '<Sequence><Script code="a += 1"/><Scripted name="work" script="R" _onHalted="a += 1"/></Sequence>'
    for tree in (nested_trees(1900, last), nested_trees(990, last, "<ReactiveSequence>{}</ReactiveSequence>")):
        tree.blackboard.set("a", 0)
        assert tree.tick_once() == RUNNING
        tree.halt_tree()
        assert tree.blackboard.get("a") == 2
        assert tree.describe()["children"]


def test_more_levels_than_the_limit_are_refused_at_the_place_where_it_is_passed() -> None:
    with pytest.raises(LoadError, match="more than 2000 levels of nodes, those of sub-trees counted") as caught:
        nested_trees(3000, LEAF)
    assert caught.value.line == 1
    with pytest.raises(LoadError, match="a tree cannot contain itself: T0 → T1 → "):
        nested_trees(3000, '<SubTree ID="T0"/>')
