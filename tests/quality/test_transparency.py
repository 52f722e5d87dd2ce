"""A quality requirement never changes what a tree does."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behavior_tree import IDLE, ManualClock, Node, NodeError, Registry, Tree, load_text
from behavior_tree.nav2 import register_nav2
from regraft.services.bt_executor.quality import PlainSystemQR, PlainTaskQR, TaskLevelQR
from tests.quality.helpers import LETTERS, Ear, Field, Spelt, system, task


@pytest.mark.parametrize("script", ["S", "F", "RS", "RRF", "K", "RK", "RRSF"])
def test_the_status_of_the_child_is_returned_and_the_child_ticked_once(script: str) -> None:
    field = Field(task(f"<Spelt name='leaf' script='{script}'/>", value="1"))
    for count, letter in enumerate(script * 2, start=1):
        assert field.tick() == letter
        assert field.leaf().ticks == count


def test_an_error_of_the_child_passes_and_ends_the_activity() -> None:
    field = Field(task("<Spelt name='leaf' script='R!'/>", value="1"))
    assert field.tick() == "R"
    with pytest.raises(NodeError, match=r"'leaf'.*the leaf broke"):
        field.tick()
    assert not field.quality("QR").active


class Broken(TaskLevelQR):
    """Breaks in every method."""

    attribute = "Safety"

    def on_start(self) -> None:
        """Break."""
        raise ZeroDivisionError("at the start")

    def measure(self) -> float | None:
        """Break."""
        raise ZeroDivisionError("no division")


class BrokenWords(TaskLevelQR):
    """Measures, and breaks when it is to say it."""

    attribute = "Safety"

    def measure(self) -> float | None:
        """Measure."""
        return 1.0

    def status_text(self, metric: float | None, satisfied: bool | None) -> str:
        """Break."""
        raise KeyError("no words")


@pytest.mark.parametrize(("node_class", "why"), [(Broken, "at the start"), (BrokenWords, "no words")])
def test_a_requirement_that_breaks_leaves_the_task_alone_and_says_why(node_class: type[Node], why: str) -> None:
    name = node_class.__name__
    field = Field(f"<{name}><Spelt script='RS'/></{name}>", node_class)
    assert field.tick() + field.tick() == "RS"
    heard = field.ear.heard[0]
    assert (heard.metric, heard.satisfied, heard.status) == (None, None, "unknown")
    assert why in heard.reason


def test_a_leaf_that_repeats_its_result_under_a_reactive_parent_does_so_under_a_requirement_too() -> None:
    leaf = "<Spelt name='leaf' script='S'/>"
    field = Field(f"<ReactiveSequence>{task(leaf, value='1')}<Spelt name='other' script='RRRS'/></ReactiveSequence>")
    bare = Field(f"<ReactiveSequence>{leaf}<Spelt name='other' script='RRRS'/></ReactiveSequence>")
    for _ in range(6):
        assert field.tick() == bare.tick()
        assert field.leaf().starts == bare.leaf().starts


# --- any tree ---

CONTROLS = ("Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback", "Parallel", "ParallelAll")
MORE_CONTROLS = ("AsyncSequence", "AsyncFallback", "SequenceWithMemory", "TryCatch", "IfThenElse", "WhileDoElse")
NAV2_CONTROLS = ("PipelineSequence", "RoundRobin")
DECORATORS = (
    "SingleTrigger",
    'RateController hz="4"',
    "Inverter",
    "ForceSuccess",
    "ForceFailure",
    "KeepRunningUntilFailure",
    "RunOnce",
    'Repeat num_cycles="2"',
    'RetryUntilSuccessful num_attempts="2"',
    'Delay delay_msec="150"',
    'Timeout msec="250"',
    'Precondition if="on == 1" else="SKIPPED"',
)
GUARDS = ("", "", "", ' _skipIf="on == 0"', ' _while="on == 1"', ' _onHalted="halts += 1"', ' _failureIf="on == 0"')

Body = tuple[str, tuple["Body", ...], bool]
"""A tag with attributes, its children, and whether a requirement stands above it."""


def bodies() -> st.SearchStrategy[Body]:
    """Return a strategy for trees."""
    guards = st.sampled_from(GUARDS)
    leaves = st.builds(
        lambda script, guard, qr: (f'Spelt script="{script}"{guard}', (), qr),
        st.text("RSFK", min_size=1, max_size=4),
        guards,
        st.booleans(),
    )

    def above(children: st.SearchStrategy[Body]) -> st.SearchStrategy[Body]:
        several = st.lists(children, min_size=2, max_size=3).map(tuple)
        control = st.builds(
            lambda tag, guard, inner, qr: (tag + guard, inner, qr),
            st.sampled_from(CONTROLS + MORE_CONTROLS + NAV2_CONTROLS),
            guards,
            several,
            st.booleans(),
        )
        decorator = st.builds(
            lambda tag, inner, qr: (tag, (inner,), qr), st.sampled_from(DECORATORS), children, st.booleans()
        )
        return control.filter(_can_be_loaded) | decorator

    return st.recursive(leaves, above, max_leaves=8)


def _can_be_loaded(body: Body) -> bool:
    """A ReactiveSequence takes only one AsyncSequence as a child, as in BehaviorTree.CPP."""
    tag, children, _ = body
    return not tag.startswith("ReactiveSequence") or sum(c[0].startswith("AsyncSequence") for c in children) < 2


def spelled(body: Body, with_requirements: bool) -> str:
    """Return the XML of a tree."""
    tag, children, has_requirement = body
    inner = "".join(spelled(child, with_requirements) for child in children)
    xml = f"<{tag}>{inner}</{tag.split()[0]}>"
    if not (with_requirements and has_requirement):
        return xml
    return system(task(xml, value="{@v}", stale_after="0.3", at_least="1"), combine="mean")


def loaded(xml: str) -> tuple[Tree, ManualClock]:
    """Return a tree and its clock."""
    clock = ManualClock()
    registry, ear = Registry(), Ear()
    register_nav2(registry)
    registry.register(Spelt)
    registry.register(PlainTaskQR, "TaskLevelQR", context=ear)
    registry.register(PlainSystemQR, "SystemLevelQR", context=ear)
    text = f'<root BTCPP_format="4"><BehaviorTree ID="M">{xml}</BehaviorTree></root>'
    tree = load_text(text, registry, clock=clock)
    tree.blackboard.set("on", 1)
    tree.blackboard.set("halts", 0)
    return tree, clock


def seen(tree: Tree) -> list[object]:
    """Return what can be seen of all nodes that are no requirements."""
    shown: list[object] = [tree.blackboard.get("halts")]
    for node in tree.nodes:
        if not isinstance(node, PlainTaskQR | PlainSystemQR):
            counts = (node.ticks, node.starts, node.halts) if isinstance(node, Spelt) else ()
            shown.append((node.type_id, LETTERS[node.status], *counts))
    return shown


def outcome(tree: Tree) -> str:
    """Tick; return the result, or what failed."""
    try:
        return LETTERS[tree.tick_once(5)]
    except NodeError as error:
        tree.halt_tree()
        return type(error.__cause__).__name__


@settings(max_examples=150, deadline=None)
@given(
    body=bodies(), steps=st.lists(st.sampled_from(["tick", "tick", "tick", "on", "off", "halt", "data"]), max_size=14)
)
def test_any_tree_goes_the_same_way_with_requirements_and_without(body: Body, steps: list[str]) -> None:
    decorated, clock = loaded(spelled(body, with_requirements=True))
    bare, other_clock = loaded(spelled(body, with_requirements=False))
    for step in ["tick", *steps]:
        for tree, time in ((decorated, clock), (bare, other_clock)):
            time.advance(0.1)
            if step in ("on", "off"):
                tree.blackboard.set("on", int(step == "on"))
            elif step == "data":
                tree.blackboard.set("v", 1.0)
            elif step == "halt":
                tree.halt_tree()
        if step == "tick":
            assert outcome(decorated) == outcome(bare)
        assert seen(decorated) == seen(bare)
    decorated.halt_tree()
    assert all(node.status == IDLE for node in decorated.nodes)
    assert not any(node.is_active for node in decorated.nodes if isinstance(node, TaskLevelQR))
