"""Whatever commands and writes come in whatever order, the mission is in the state that they lead to."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from regraft import CallFailed
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    Command,
    MissionState,
    MissionStatus,
    MissionTransitions,
    NodeStatus,
    WriteBlackboard,
)
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, status, tree
from tests.executor.robot import Navigator

DRIVE = tree('<NavigateTo x="3.0" y="4.0"/>', '<Sleep msec="100000000"/>')
OTHER = tree(
    '<Script code="n := 1"/>', '<Parallel success_count="2"><NavigateTo x="{n}" y="4.0"/><AlwaysSuccess/></Parallel>'
)
BROKEN = tree("<Unknown/>")

EMPTY, LOADED = MissionState.EMPTY, MissionState.LOADED
RUNNING, PAUSED, HALTED = MissionState.RUNNING, MissionState.PAUSED, MissionState.HALTED
FOLLOWING = {
    (EMPTY, Command.LOAD): LOADED,
    (LOADED, Command.LOAD): LOADED,
    (LOADED, Command.START): RUNNING,
    (LOADED, Command.STEP): PAUSED,
    (RUNNING, Command.LOAD): LOADED,
    (RUNNING, Command.PAUSE): PAUSED,
    (RUNNING, Command.HALT): HALTED,
    (PAUSED, Command.LOAD): LOADED,
    (PAUSED, Command.START): RUNNING,
    (PAUSED, Command.STEP): PAUSED,
    (PAUSED, Command.HALT): HALTED,
    (HALTED, Command.LOAD): LOADED,
    (HALTED, Command.START): RUNNING,
    (HALTED, Command.STEP): PAUSED,
    (RUNNING, Command.SWAP): RUNNING,
    (PAUSED, Command.SWAP): PAUSED,
}
"""The state after each command that is legal; all others are refused and change nothing."""

FOLLOWING |= {
    (LOADED, Command.NEXT): PAUSED,
    (RUNNING, Command.NEXT): RUNNING,
    (PAUSED, Command.NEXT): PAUSED,
    (HALTED, Command.NEXT): PAUSED,
}
FOLLOWING |= {(state, Command.CHECK): state for state in (EMPTY, LOADED, RUNNING, PAUSED, HALTED)}

ENDED = (MissionState.SUCCEEDED, MissionState.FAILED)
FOLLOWING |= {
    (ended, what): FOLLOWING[HALTED, what] for ended in ENDED for what in Command if (HALTED, what) in FOLLOWING
}
FOLLOWING |= {(ended, Command.CHECK): ended for ended in ENDED}

TICKING = (Command.STEP, Command.SWAP, Command.NEXT, Command.CONTINUE)
TAKE_A_TREE = (Command.LOAD, Command.SWAP, Command.CHECK)

odd_values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)
writes = st.dictionaries(st.sampled_from(["n", "free", "@n", "a b", "", "{n}", "é"]), odd_values, max_size=3)
broken = st.sampled_from(TAKE_A_TREE).map(lambda command: (command, BROKEN))
deeds = st.one_of(st.sampled_from(Command), broken, st.floats(0.05, 4.0), writes)
Deed = Command | tuple[Command, str] | float | dict[str, PlainValue]


@settings(max_examples=40, deadline=None)
@given(st.lists(deeds, max_size=14))
def test_legal_commands_are_obeyed_and_all_others_are_refused(sequence: list[Deed]) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Executor)
        told = rig.collect("mission/transitions", MissionTransitions)
        state = EMPTY
        for deed in sequence:
            if isinstance(deed, float):
                rig.advance(deed)
                state = status(rig).state if state is RUNNING else state
            elif isinstance(deed, dict):
                write_or_be_refused(rig, deed)
            else:
                state = obeyed(rig, deed)
            assert status(rig).state is state
            followed(told, status(rig))
        rig.advance(0.1)
        under_way = len(navigator.asked) - len(navigator.reached) - len(navigator.cancelled)
        assert under_way <= (status(rig).state in (RUNNING, PAUSED)), "a goal outlived its mission"
        assert [event for event in rig.events if event.kind == "component.fault"] == []


def obeyed(rig: Rig, deed: Command | tuple[Command, str]) -> MissionState:
    """Give a command; returns the state that must follow."""
    what, xml = deed if isinstance(deed, tuple) else (deed, OTHER if deed is Command.SWAP else DRIVE)
    before = status(rig)
    following = None if xml == BROKEN else following_state(before, what)
    try:
        command(rig, what, xml if what in TAKE_A_TREE else "")
    except CallFailed:
        assert following is None
        assert status(rig) == before
        return before.state
    assert following is not None
    now = status(rig).state
    return now if what in TICKING and now in ENDED else following


def following_state(before: MissionStatus, what: Command) -> MissionState | None:
    """Return the state to which a command leads, None if it is to be refused."""
    if what is Command.CONTINUE:
        return before.state if before.stop is not None else None
    if what is Command.STEP and before.stop is not None:
        return None
    return FOLLOWING.get((before.state, what))


def write_or_be_refused(rig: Rig, values: dict[str, PlainValue]) -> None:
    """Write; if it is refused nothing may have changed."""
    before = status(rig).blackboard
    try:
        rig.call("mission/write", WriteBlackboard(values), BlackboardEntries)
    except (CallFailed, BadMessage):
        assert status(rig).blackboard == before


def followed(told: list[MissionTransitions], now: MissionStatus) -> None:
    """Make sure that who follows the transitions knows the statuses."""
    known = dict.fromkeys((node.uid for node in now.nodes), NodeStatus.IDLE)
    for batch in told:
        for change in batch.changes if batch.structure == now.structure else ():
            assert known[change.uid] is change.before
            known[change.uid] = change.after
    assert known == {node.uid: node.status for node in now.nodes}
