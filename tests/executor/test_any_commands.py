"""Whatever commands come in whatever order, the mission is in the state that they lead to."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from bus_schema.messages.mission import Command, MissionState
from regraft import CallFailed
from regraft.testing import Rig
from services.bt_executor.executor import Executor
from tests.executor.helpers import command, status, tree
from tests.executor.robot import Navigator

DRIVE = tree('<NavigateTo x="3.0" y="4.0"/>', '<Sleep msec="100000000"/>')
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
}
"""The state after each command that is legal; all others are refused and change nothing."""

deeds = st.one_of(st.sampled_from(Command), st.just("broken"), st.floats(0.05, 4.0))


@settings(max_examples=60, deadline=None)
@given(st.lists(deeds, max_size=12))
def test_legal_commands_are_obeyed_and_all_others_are_refused(sequence: list[Command | str | float]) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Executor)
        state = EMPTY
        for deed in sequence:
            if isinstance(deed, float):
                rig.advance(deed)
            else:
                state = _obeyed(rig, deed, state)
            assert status(rig).state is state
        rig.advance(0.1)
        under_way = len(navigator.asked) - len(navigator.reached) - len(navigator.cancelled)
        assert under_way <= (state in (RUNNING, PAUSED)), "a goal outlived its mission"
        assert [event for event in rig.events if event.kind == "component.fault"] == []


def _obeyed(rig: Rig, deed: Command | str, state: MissionState) -> MissionState:
    """Give a command; returns the state that must follow."""
    what = Command(deed) if isinstance(deed, Command) else Command.LOAD
    xml = "" if what is not Command.LOAD else BROKEN if deed == "broken" else DRIVE
    following = None if deed == "broken" else FOLLOWING.get((state, what))
    try:
        command(rig, what, xml)
    except CallFailed:
        assert following is None
        return state
    assert following is not None
    return following
