"""Who follows a mission sees every change of a node's status."""

from __future__ import annotations

from regraft.bus_schema.messages.mission import Command, MissionTransitions, NodeStatus
from regraft.services.bt_executor.observing.transitions import MAX_AT_ONCE
from regraft.testing import Rig
from tests.executor.helpers import command, run, status, tree

WAIT = '<Sleep name="wait" msec="100000"/>'
IDLE, RUNNING, SUCCESS = NodeStatus.IDLE, NodeStatus.RUNNING, NodeStatus.SUCCESS


def changes(batch: MissionTransitions) -> list[tuple[int, NodeStatus, NodeStatus]]:
    """Return the changes of one tick."""
    return [(change.uid, change.before, change.after) for change in batch.changes]


def test_the_changes_of_a_tick_come_together_and_in_their_order() -> None:
    with Rig() as rig:
        told = rig.collect("mission/transitions", MissionTransitions)
        run(rig, tree("<AlwaysSuccess/>", WAIT))
        rig.advance(1.0)
        (first,) = told
        assert changes(first) == [(1, IDLE, RUNNING), (2, IDLE, SUCCESS), (3, IDLE, RUNNING)]
        assert (first.tick, first.structure) == (1, status(rig).structure)
        command(rig, Command.HALT)
        assert changes(told[-1]) == [(2, SUCCESS, IDLE), (3, RUNNING, IDLE), (1, RUNNING, IDLE)]


def test_a_step_tells_its_changes() -> None:
    with Rig() as rig:
        told = rig.collect("mission/transitions", MissionTransitions)
        run(rig, tree(WAIT))
        command(rig, Command.PAUSE)
        so_far = len(told)
        command(rig, Command.HALT)
        command(rig, Command.STEP)
        assert [batch.tick for batch in told[so_far:]][-1] == 1


def test_halting_the_old_tree_is_told_as_of_the_old_one() -> None:
    with Rig() as rig:
        told = rig.collect("mission/transitions", MissionTransitions)
        run(rig, tree(WAIT, name="Old"))
        rig.advance(0.5)
        old = status(rig).structure
        new = command(rig, Command.SWAP, tree("<AlwaysSuccess/>", WAIT, name="New")).structure
        assert [batch.structure for batch in told] == [old, old, new]
        assert all(change.after is IDLE for change in told[1].changes)


def test_nothing_is_told_where_nobody_reads() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        rig.advance(1.0)
        executor = rig.runtimes["bt_executor"]
        assert executor.writers.sequences()[executor.outputs["transitions"].key] == 0


def test_a_batch_is_bounded_and_says_what_it_leaves_out() -> None:
    with Rig() as rig:
        told = rig.collect("mission/transitions", MissionTransitions)
        leaves = "<AlwaysSuccess/>" * 60
        run(rig, tree(f'<Repeat num_cycles="-1"><Sequence>{leaves}</Sequence></Repeat>'))
        rig.advance(0.1)
        assert len(told[0].changes) == MAX_AT_ONCE
        assert told[0].missed > 0
