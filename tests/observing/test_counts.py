"""An executor counts what nodes do if its parameter asks for it."""

from __future__ import annotations

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.mission import (
    Command,
    MissionCounts,
    MissionCountsRequest,
    MissionState,
    NodeCounts,
    NodeStatus,
)
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, run, status, tree

WAIT = '<Sleep name="wait" msec="100000"/>'


def counts(rig: Rig, *, reset: bool = False) -> dict[str, NodeCounts]:
    """Return the counts by the nodes' names."""
    now = status(rig)
    counted = rig.call("mission/counts", MissionCountsRequest(reset), MissionCounts)
    assert counted.structure == now.structure
    return {node.name: found for node, found in zip(now.nodes, counted.nodes, strict=True)}


def set_counts(executor: Executor, wanted: bool) -> None:
    """Set the parameter while the executor runs."""
    executor.kit.parameters.set({"counts": wanted})
    executor.on_parameters(frozenset({"counts"}))


def why_not(rig: Rig) -> CallFailed:
    """Ask for counts in vain."""
    with pytest.raises(CallFailed) as refused:
        rig.call("mission/counts", MissionCountsRequest(), MissionCounts)
    return refused.value


def test_ticks_results_and_times_are_counted_from_the_start() -> None:
    with Rig() as rig:
        run(rig, tree('<Script code="n := 1"/>', WAIT), counts=True)
        rig.advance(1.0)
        counted = counts(rig)
        assert (counted["Script"].ticks, counted["Script"].successes) == (1, 1)
        assert counted["Script"].last_result is NodeStatus.SUCCESS
        assert counted["wait"].ticks == status(rig).ticks
        assert (counted["wait"].transitions, counted["wait"].last_result) == (1, NodeStatus.IDLE)
        assert counted["wait"].last_change is not None


def test_without_the_parameter_nothing_is_counted_and_the_answer_names_it() -> None:
    with Rig() as rig:
        executor = run(rig, tree(WAIT))
        rig.advance(0.5)
        refused = why_not(rig)
        assert refused.code is RefusalCode.CONFLICT
        assert "set the parameter 'counts' to true" in refused.why
        tree_now = executor._mission.tree
        assert tree_now is not None
        assert all(node.post_tick_hook is None for node in tree_now.nodes)


def test_without_a_tree_there_are_no_counts() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"counts": True})
        assert why_not(rig).code is RefusalCode.NOT_FOUND


def test_counting_begins_and_ends_while_the_mission_runs() -> None:
    with Rig() as rig:
        executor = run(rig, tree(WAIT))
        rig.advance(1.0)
        set_counts(executor, True)
        rig.advance(1.0)
        assert 0 < counts(rig)["wait"].ticks < status(rig).ticks
        set_counts(executor, False)
        assert why_not(rig).code is RefusalCode.CONFLICT
        rig.advance(1.0)
        assert status(rig).state is MissionState.RUNNING


def test_counts_begin_again_from_zero_with_another_tree_or_when_asked_to() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT), counts=True)
        rig.advance(1.0)
        assert counts(rig, reset=True)["wait"].ticks > 0
        assert counts(rig)["wait"].ticks == 0
        rig.advance(1.0)
        command(rig, Command.SWAP, tree(WAIT, name="Other"))
        assert counts(rig)["wait"].ticks == 1


def test_a_counted_mission_does_what_it_does_uncounted() -> None:
    body = (
        '<Repeat num_cycles="3"><Sequence><Script code="n += 1"/><Sleep msec="150"/></Sequence></Repeat>',
        '<ScriptCondition code="n == 3"/>',
    )
    seen = []
    for counted in (False, True):
        with Rig() as rig:
            run(rig, tree('<Script code="n := 0"/>', *body), counts=counted)
            rig.advance(2.0)
            now = status(rig)
            seen.append((now.state, now.ticks, now.blackboard))
    assert seen[0] == seen[1]
    assert seen[0][0] is MissionState.SUCCEEDED
