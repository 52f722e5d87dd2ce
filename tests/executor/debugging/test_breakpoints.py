"""Missions stop at breakpoints, answer while they are stopped, and go on as asked."""

from __future__ import annotations

from typing import Any

import pytest

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BreakpointChange,
    BreakpointsRequest,
    Command,
    ForcedResult,
    MissionBreakpoints,
    MissionCommand,
    MissionRequest,
    MissionState,
    MissionStatus,
    MissionStop,
    NodeStatus,
    TickPosition,
    WriteBlackboard,
)
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, entry, kinds, node_statuses, refusal, run, status, tree
from tests.executor.robot import Navigator
from tests.stepped.parts import TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import wait_until

ENDLESS = 1e6
"""Seconds of simulated time that no test waits for."""
BEFORE, AFTER = TickPosition.BEFORE, TickPosition.AFTER
FIRST = '<Script name="first" code="n := 1"/>'
SECOND = '<Script name="second" code="m := n + 1"/>'
WAIT = '<Sleep name="wait" msec="10000"/>'
DRIVE = '<NavigateTo name="drive" x="3.0" y="4.0"/>'
THREE = tree(FIRST, SECOND, WAIT)


def loaded(rig: Rig, xml: str = THREE, **parameters: Any) -> None:
    rig.add(Executor, "bt_executor", {"autostart": False, **parameters})
    command(rig, Command.LOAD, xml)


def change(rig: Rig, what: BreakpointChange, node: str = "", *more: Any) -> MissionBreakpoints:
    return rig.call("mission/breakpoints", BreakpointsRequest(what, node, *more), MissionBreakpoints)


def stop_at(rig: Rig, node: str, *more: Any) -> None:
    change(rig, BreakpointChange.SET, node, *more)


def go(rig: Rig, what: Command, result: ForcedResult | None = None) -> MissionStatus:
    return rig.call("mission/command", MissionCommand(what, result=result), MissionStatus)


def test_a_mission_stops_in_the_middle_of_a_tick_and_answers() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second")
        command(rig, Command.START)
        rig.advance(5.0)
        stopped = status(rig)
        assert stopped.stop == MissionStop(3, "second", BEFORE)
        assert (stopped.state, stopped.ticks, stopped.blackboard["n"]) == (MissionState.RUNNING, 1, 1)
        assert "m" not in stopped.blackboard
        assert node_statuses(stopped)["first"] is NodeStatus.SUCCESS
        assert kinds(rig)[-1] == "mission.stopped"


def test_it_goes_on_where_it_stopped_and_sees_what_was_written_meanwhile() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second")
        command(rig, Command.START)
        rig.advance(1.0)
        rig.call("mission/write", WriteBlackboard({"n": 41}), BlackboardEntries)
        rig.advance(1.0)
        went_on = go(rig, Command.CONTINUE)
        assert (went_on.stop, went_on.ticks, went_on.running) == (None, 1, ("wait",))
        assert entry(rig, "m").value == 42
        rig.advance(10.1)
        assert status(rig).state is MissionState.SUCCEEDED


@pytest.mark.parametrize(("position", "m"), [(BEFORE, None), (AFTER, 2)])
def test_a_result_is_forced_on_the_node_at_which_it_stopped(position: TickPosition, m: int | None) -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second", position)
        command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).stop == MissionStop(
            3, "second", position, None if position is BEFORE else NodeStatus.SUCCESS
        )
        failed = go(rig, Command.CONTINUE, ForcedResult.FAILURE)
        assert (failed.state, failed.stop) == (MissionState.FAILED, None)
        assert failed.blackboard.get("m") == m


def test_a_breakpoint_with_a_result_forces_it_without_a_stop() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second", BEFORE, ForcedResult.FAILURE, True)
        command(rig, Command.START)
        rig.advance(0.2)
        assert status(rig).state is MissionState.FAILED
        assert change(rig, BreakpointChange.NONE).breakpoints == ()


def test_a_result_forced_on_a_node_that_runs_ends_what_it_does() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        run(rig, tree(f"<Fallback>{DRIVE}{WAIT}</Fallback>"))
        rig.advance(1.0)
        stop_at(rig, "drive")
        rig.advance(0.2)
        assert go(rig, Command.CONTINUE, ForcedResult.FAILURE).running == ("wait",)
        rig.advance(0.1)
        assert navigator.cancelled == [3.0]


def test_a_result_forced_on_a_node_that_has_just_begun_ends_what_it_does() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        loaded(rig, tree(DRIVE, WAIT))
        stop_at(rig, "drive", AFTER, ForcedResult.SUCCESS)
        command(rig, Command.START)
        rig.advance(0.2)
        assert status(rig).running == ("wait",)
        assert navigator.cancelled == navigator.asked == [3.0]


def test_a_result_forced_on_the_root_ends_the_nodes_below_it() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        run(rig, tree(FIRST, DRIVE))
        rig.advance(1.0)
        go(rig, Command.NEXT)
        assert go(rig, Command.NEXT, ForcedResult.SUCCESS).state is MissionState.SUCCEEDED
        rig.advance(0.1)
        assert navigator.cancelled == [3.0]
        rig.call("mission/write", WriteBlackboard({"n": 5}), BlackboardEntries)
        command(rig, Command.START)
        rig.advance(1.0)
        assert entry(rig, "n").value == 1


def test_next_goes_from_node_to_node_from_the_root_of_a_tree_that_was_not_started() -> None:
    with Rig() as rig:
        loaded(rig)
        stops = [go(rig, Command.NEXT).stop for _ in range(4)]
        assert [stop and stop.node for stop in stops] == ["Sequence::1", "first", "second", "wait"]
        went_on = go(rig, Command.CONTINUE)
        assert (went_on.state, went_on.running, went_on.stop) == (MissionState.PAUSED, ("wait",), None)
        rig.advance(20.0)
        assert status(rig).ticks == 1
        command(rig, Command.START)
        rig.advance(0.2)
        assert status(rig).state is MissionState.SUCCEEDED


def test_next_stops_a_running_mission_at_its_root() -> None:
    with Rig() as rig:
        run(rig, THREE)
        rig.advance(1.0)
        assert go(rig, Command.NEXT).stop == MissionStop(1, "Sequence::1", BEFORE)
        rig.advance(0.2)
        skipped = go(rig, Command.NEXT, ForcedResult.SUCCESS)
        assert (skipped.state, skipped.stop) == (MissionState.SUCCEEDED, None)
        command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).stop is None


def test_next_at_the_end_of_a_tick_begins_another() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "wait", AFTER)
        command(rig, Command.START)
        rig.advance(0.2)
        begun = go(rig, Command.NEXT)
        assert (begun.stop, begun.ticks) == (MissionStop(1, "Sequence::1", BEFORE), 2)


def test_a_mission_that_has_stopped_can_be_halted_and_started_again() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        loaded(rig, tree(f"<Parallel>{DRIVE}{FIRST}</Parallel>"))
        stop_at(rig, "first", AFTER, None, True)
        command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).stop is not None
        halted = command(rig, Command.HALT)
        assert (halted.state, halted.stop) == (MissionState.HALTED, None)
        assert set(node_statuses(halted).values()) == {NodeStatus.IDLE}
        rig.advance(0.1)
        assert navigator.cancelled == [3.0]
        command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).running == ("drive",)


@pytest.mark.parametrize("what", [Command.LOAD, Command.SWAP])
def test_another_tree_takes_the_place_of_one_that_has_stopped_and_has_no_breakpoints(what: Command) -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second")
        command(rig, Command.START)
        rig.advance(1.0)
        after = command(rig, what, tree(FIRST, WAIT, name="Other"))
        assert (after.tree, after.stop) == ("Other", None)
        assert change(rig, BreakpointChange.NONE).breakpoints == ()
        if what is Command.LOAD:
            command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).running == ("wait",)


def test_a_tree_that_cannot_be_loaded_leaves_the_stopped_one_as_it_is() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second")
        command(rig, Command.START)
        rig.advance(1.0)
        before = status(rig)
        refusal(rig, Command.SWAP, tree("<Nonsense/>"))
        assert (status(rig).stop, status(rig).structure) == (before.stop, before.structure)
        assert go(rig, Command.CONTINUE).running == ("wait",)


def test_a_stopped_mission_that_is_paused_finishes_its_tick_and_no_other() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second")
        command(rig, Command.START)
        rig.advance(1.0)
        command(rig, Command.PAUSE)
        assert "in the middle of a tick" in refusal(rig, Command.STEP)
        went_on = go(rig, Command.CONTINUE)
        assert (went_on.state, went_on.ticks) == (MissionState.PAUSED, 1)
        rig.advance(20.0)
        assert status(rig).ticks == 1


def test_a_node_that_fails_after_a_stop_fails_the_mission() -> None:
    with Rig() as rig:
        loaded(rig, tree(FIRST, '<Script name="bad" code="x = 1"/>', WAIT))
        stop_at(rig, "bad")
        command(rig, Command.START)
        rig.advance(1.0)
        failed = go(rig, Command.CONTINUE)
        assert failed.state is MissionState.FAILED
        assert "'bad'" in failed.error


def test_commands_that_make_no_sense_are_refused() -> None:
    with Rig() as rig:
        loaded(rig)
        assert "has not stopped" in refusal(rig, Command.CONTINUE)
        with pytest.raises(CallFailed, match="has not stopped at a node"):
            go(rig, Command.NEXT, ForcedResult.SUCCESS)
        with pytest.raises(CallFailed, match="forces no result"):
            go(rig, Command.START, ForcedResult.SUCCESS)
        assert status(rig).ticks == 0


@pytest.mark.parametrize(
    ("what", "node", "code", "why"),
    [
        (BreakpointChange.SET, "secnd", RefusalCode.NOT_FOUND, "did you mean 'second'?"),
        (BreakpointChange.SET, "", RefusalCode.NOT_FOUND, "there are"),
        (BreakpointChange.SET, "Script", RefusalCode.INVALID, "2 nodes are called 'Script'"),
        (BreakpointChange.REMOVE, "second", RefusalCode.NOT_FOUND, "there is no breakpoint before 'second'"),
    ],
)
def test_breakpoints_that_cannot_be_are_refused(what: BreakpointChange, node: str, code: RefusalCode, why: str) -> None:
    with Rig() as rig:
        loaded(rig)
        with pytest.raises(CallFailed) as refused:
            change(rig, what, node)
        assert refused.value.code is code
        assert why in refused.value.why


def test_breakpoints_are_listed_removed_and_cleared() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "4", AFTER)
        stop_at(rig, "Sequence")
        listed = stop = change(rig, BreakpointChange.SET, "second", BEFORE, ForcedResult.SUCCESS, True)
        assert [(each.node, each.position) for each in listed.breakpoints] == [
            ("Sequence::1", BEFORE),
            ("second", BEFORE),
            ("wait", AFTER),
        ]
        assert (stop.breakpoints[1].result, stop.breakpoints[1].once) == (ForcedResult.SUCCESS, True)
        assert len(change(rig, BreakpointChange.REMOVE, "second").breakpoints) == 2
        assert change(rig, BreakpointChange.CLEAR).breakpoints == ()
        command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).running == ("wait",)


def test_an_executor_that_is_deactivated_while_stopped_starts_its_mission_again() -> None:
    with Rig() as rig:
        loaded(rig)
        stop_at(rig, "second", BEFORE, None, True)
        command(rig, Command.START)
        rig.advance(1.0)
        rig.transition("bt_executor", Transition.DEACTIVATE)
        rig.transition("bt_executor", Transition.ACTIVATE)
        rig.advance(1.0)
        assert status(rig).running == ("wait",)


class Held:
    """An executor in step whose mission stops at a breakpoint."""

    def __init__(self, *, hold_time: bool) -> None:
        self.steps = StepSite("memory")
        parameters = {"autostart": False, "hold_time": hold_time}
        self.steps.start(Executor, "bt_executor", parameters=parameters, state=State.ACTIVE)
        self.steps.start_world(TinyWorld, ("bt_executor",), ENDLESS)
        self.ask(MissionCommand(Command.LOAD, THREE))
        request = BreakpointsRequest(BreakpointChange.SET, "second")
        self.steps.client.call("mission/breakpoints", request, MissionBreakpoints)
        self.ask(MissionCommand(Command.START))
        wait_until(lambda: self.status().stop is not None, "the stop")

    def ask(self, what: MissionCommand) -> MissionStatus:
        return self.steps.client.call("mission/command", what, MissionStatus)

    def status(self) -> MissionStatus:
        return self.steps.client.call("mission/status", MissionRequest(), MissionStatus)


def test_simulated_time_stands_while_a_tick_has_stopped_if_it_is_to() -> None:
    held = Held(hold_time=True)
    try:
        stopped = held.status().stamp
        assert {held.status().stamp for _ in range(20)} == {stopped}
        assert held.ask(MissionCommand(Command.CONTINUE)).stamp == stopped
        held.steps.wait_for_time(stopped + 10.0)
        assert held.steps.told().reproducible
    finally:
        held.steps.close()


def test_time_is_held_and_released_when_the_parameter_is_set_during_a_stop() -> None:
    with Rig() as rig:
        executor = rig.add(Executor, "bt_executor", {"autostart": False})
        command(rig, Command.LOAD, THREE)
        stop_at(rig, "second")
        command(rig, Command.START)
        rig.advance(1.0)
        for hold in (True, False):
            executor.kit.parameters.set({"hold_time": hold})
            executor.on_parameters(frozenset({"hold_time"}))
            assert rig.runtimes["bt_executor"].holds_time is hold


def test_simulated_time_continues_while_a_tick_has_stopped_by_default() -> None:
    held = Held(hold_time=False)
    try:
        held.steps.wait_for_time(held.status().stamp + 10.0)
        assert held.status().stop is not None
    finally:
        held.steps.close()


def test_time_that_stands_continues_when_the_executor_dies() -> None:
    held = Held(hold_time=True)
    try:
        stopped = held.status().stamp
        held.steps.kill("bt_executor")
        held.steps.wait_for_time(stopped + 10.0)
        assert held.steps.told().dropped == ("bt_executor",)
    finally:
        held.steps.close()
