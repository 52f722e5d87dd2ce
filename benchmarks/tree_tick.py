"""One pass through a tree of 50 nodes: our engine against py_trees on the same tree; and through one of 1,000."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import py_trees

from behavior_tree import RUNNING, SUCCESS, Condition, Registry, StatefulAction, Status, load_text
from benchmarks.harness import Effort, Result, compared, in_turns

TICKS = 300
LIMIT, PARALLEL_LIMIT = 10.0, 8.0
BRANCHES, MANY_BRANCHES = 8, 166
Theirs = py_trees.behaviour.Behaviour


class Yes(Condition):
    """Always true."""

    def tick(self) -> Status:
        """Succeed."""
        return SUCCESS


class Act(StatefulAction):
    """Never done."""

    def on_start(self) -> Status:
        """Begin."""
        return RUNNING

    def on_running(self) -> Status:
        """Go on."""
        return RUNNING


def reactive() -> py_trees.behaviour.Behaviour:
    """Return py_trees' reactive tree: 48 conditions before an action."""
    root = py_trees.composites.Sequence("root", memory=False)
    root.add_children([*(_succeeding() for _ in range(48)), py_trees.behaviours.Running("act")])
    return root


def mission(branches: int = BRANCHES, ends: int = 1) -> py_trees.behaviour.Behaviour:
    """Return py_trees' mission-like tree: a sequence of fallbacks, each with a refuted condition and a sequence."""
    root = py_trees.composites.Sequence("root", memory=True)
    for _ in range(branches):
        fallback = py_trees.composites.Selector("fallback", memory=True)
        steps = py_trees.composites.Sequence("steps", memory=True)
        steps.add_children([_succeeding(), _succeeding()])
        fallback.add_children([py_trees.decorators.Inverter("not", _succeeding()), steps])
        root.add_child(fallback)
    root.add_children([_succeeding() for _ in range(ends)])
    return root


def parallel() -> py_trees.behaviour.Behaviour:
    """Return py_trees' parallel tree: 49 running actions."""
    root = py_trees.composites.Parallel("root", policy=py_trees.common.ParallelPolicy.SuccessOnAll(synchronise=False))
    root.add_children([py_trees.behaviours.Running(f"act {number}") for number in range(49)])
    return root


def _succeeding() -> py_trees.behaviour.Behaviour:
    return py_trees.behaviours.Success("yes")


FALLBACK = "<Fallback><Inverter><Yes/></Inverter><Sequence><Yes/><Yes/></Sequence></Fallback>"
TREES: tuple[tuple[str, str, Callable[[], Theirs], float | None], ...] = (
    ("reactive", f"<ReactiveSequence>{'<Yes/>' * 48}<Act/></ReactiveSequence>", reactive, LIMIT),
    ("mission-like", f"<Sequence>{FALLBACK * BRANCHES}<Yes/></Sequence>", mission, LIMIT),
    ("parallel", f"<Parallel>{'<Act/>' * 49}</Parallel>", parallel, PARALLEL_LIMIT),
    (
        "large",
        f"<Sequence>{FALLBACK * MANY_BRANCHES}{'<Yes/>' * 3}</Sequence>",
        partial(mission, MANY_BRANCHES, 3),
        None,
    ),
)


def tree_tick(effort: Effort) -> list[Result]:
    """Tick each tree; the large one for information."""
    registry = Registry()
    registry.register(Yes)
    registry.register(Act)
    results = []
    for name, body, build, limit in TREES:
        text = f'<root BTCPP_format="4"><BehaviorTree ID="M">{body}</BehaviorTree></root>'
        ours, theirs = load_text(text, registry), build()
        count = effort.count(TICKS if limit else TICKS // 10)
        sides = in_turns(
            effort.rounds,
            partial(_times, ours.tick_exactly_once, count),
            partial(_times, theirs.tick_once, count),
        )
        note = f"{len(ours.nodes)} nodes; {effort.rounds} rounds of {count}"
        results.append(
            compared(f"tree tick, {name}", sides, "µs", "py_trees", limit, scale=1e6, times_faster=True, note=note)
        )
    return results


def _times(tick: Callable[[], object], count: int) -> list[float]:
    took = []
    for _ in range(count):
        begun = time.perf_counter()
        tick()
        took.append(time.perf_counter() - begun)
    return took
