"""What the executor does when it is told to, and what it refuses."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.mission import Command, MissionNode, MissionState, MissionStatus, NodeStatus
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, kinds, node_statuses, refusal, run, status, tree
from tests.executor.robot import Navigator

DRIVE = '<NavigateTo name="drive" x="3.0" y="4.0"/>'
COUNT = '<Script name="count" code="n := 1"/>'
WAIT = '<Sleep name="wait" msec="10000"/>'
PAUSED_AT_ONCE = '<Sleep name="first" msec="300"/>'


def test_a_mission_without_a_file_waits_for_a_tree() -> None:
    with Rig() as rig:
        rig.add(Executor)
        assert status(rig).state is MissionState.EMPTY
        assert command(rig, Command.LOAD, tree(WAIT)).state is MissionState.LOADED
        assert command(rig, Command.START).state is MissionState.RUNNING


@pytest.mark.parametrize("what", [Command.START, Command.PAUSE, Command.STEP, Command.HALT])
def test_nothing_but_load_is_possible_without_a_tree(what: Command) -> None:
    with Rig() as rig:
        rig.add(Executor)
        assert "there is no tree" in refusal(rig, what)


def test_load_without_tree_and_without_file_is_refused() -> None:
    with Rig() as rig:
        rig.add(Executor)
        assert "give its XML" in refusal(rig, Command.LOAD)


def test_what_makes_no_sense_while_it_runs_is_refused() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        assert "pause or halt it" in refusal(rig, Command.START)
        assert "pause it, then step" in refusal(rig, Command.STEP)
        assert status(rig).state is MissionState.RUNNING


def test_what_makes_no_sense_after_halting_is_refused() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        command(rig, Command.HALT)
        assert "only a running mission" in refusal(rig, Command.PAUSE)
        assert "nothing to halt" in refusal(rig, Command.HALT)


def test_a_tree_with_another_command_than_load_is_refused() -> None:
    with Rig() as rig:
        rig.add(Executor)
        assert "load it, then start" in refusal(rig, Command.START, tree(WAIT))


def test_halting_cancels_the_goal() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        run(rig, tree(DRIVE))
        rig.advance(1.0)
        assert command(rig, Command.HALT).state is MissionState.HALTED
        rig.advance(0.1)
        assert navigator.cancelled == [3.0]
        assert set(node_statuses(status(rig)).values()) == {NodeStatus.IDLE}


def test_a_halted_mission_starts_from_its_root() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        run(rig, tree(DRIVE, WAIT))
        rig.advance(3.0)
        command(rig, Command.HALT)
        command(rig, Command.START)
        rig.advance(1.0)
        assert navigator.asked == [3.0, 3.0]


def test_a_paused_tree_is_not_ticked_until_it_goes_on() -> None:
    with Rig() as rig:
        run(rig, tree(PAUSED_AT_ONCE, COUNT, WAIT))
        rig.advance(0.1)
        assert command(rig, Command.PAUSE).state is MissionState.PAUSED
        rig.advance(5.0)
        paused = status(rig)
        assert "n" not in paused.blackboard or paused.blackboard["n"] is None
        assert paused.running == ("first",)
        command(rig, Command.START)
        rig.advance(0.2)
        assert status(rig).blackboard["n"] == 1


def test_a_goal_given_before_a_pause_goes_on() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        run(rig, tree(DRIVE))
        rig.advance(1.0)
        command(rig, Command.PAUSE)
        rig.advance(5.0)
        assert navigator.reached == [3.0]
        command(rig, Command.START)
        rig.advance(0.1)
        assert status(rig).state is MissionState.SUCCEEDED


def test_a_step_ticks_once() -> None:
    with Rig() as rig:
        run(rig, tree(PAUSED_AT_ONCE, COUNT, WAIT))
        rig.advance(0.15)
        before = command(rig, Command.PAUSE).ticks
        rig.advance(5.0)
        stepped = command(rig, Command.STEP)
        assert stepped.state is MissionState.PAUSED
        assert stepped.ticks == before + 1
        assert stepped.running == ("wait",)


def test_a_loaded_tree_can_be_stepped_through_from_its_root() -> None:
    with Rig() as rig:
        rig.add(Executor)
        command(rig, Command.LOAD, tree(COUNT, WAIT))
        stepped = command(rig, Command.STEP)
        assert (stepped.state, stepped.ticks, stepped.running) == (MissionState.PAUSED, 1, ("wait",))


def test_a_broken_tree_is_refused_with_its_line_and_the_mission_goes_on() -> None:
    with Rig() as rig:
        run(rig, tree(WAIT))
        why = refusal(rig, Command.LOAD, tree(COUNT, '<NavigateTo x="here" y="0"/>'))
        assert ":3:" in why
        assert "'here' is not a number" in why
        still = status(rig)
        assert still.state is MissionState.RUNNING
        assert still.running == ("wait",)


def test_text_that_is_no_xml_is_refused_with_its_line() -> None:
    with Rig() as rig:
        rig.add(Executor)
        assert ":2:" in refusal(rig, Command.LOAD, "<root>\n<oops</root>")


def test_loading_while_running_halts_the_old_tree() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        run(rig, tree(DRIVE))
        rig.advance(1.0)
        loaded = command(rig, Command.LOAD, tree(WAIT, name="Other"))
        assert (loaded.state, loaded.tree) == (MissionState.LOADED, "Other")
        rig.advance(0.1)
        assert navigator.cancelled == [3.0]


def test_the_status_lists_every_node() -> None:
    with Rig() as rig:
        run(rig, tree(COUNT, '<Inverter name="not"><Sleep msec="5000"/></Inverter>'))
        rig.advance(0.5)
        assert status(rig).nodes == (
            MissionNode(1, 0, "Sequence", "Sequence", "Sequence::1", NodeStatus.RUNNING, {}),
            MissionNode(2, 1, "count", "Script", "count", NodeStatus.SUCCESS, {"code": "n := 1"}),
            MissionNode(3, 1, "not", "Inverter", "not", NodeStatus.RUNNING, {}),
            MissionNode(4, 3, "Sleep", "Sleep", "Sleep::4", NodeStatus.RUNNING, {"msec": "5000"}),
        )


def test_the_status_tells_the_quality_requirements() -> None:
    with Rig() as rig:
        measured = (
            f'<TaskLevelQR name="Quick" quality_attribute="Speed" value="{{v}}" at_least="0.2">{WAIT}</TaskLevelQR>'
        )
        run(rig, tree('<Script code="v := 0.1"/>', measured))
        rig.advance(0.5)
        (quality,) = status(rig).qualities
        assert (quality.requirement, quality.attribute, quality.metric, quality.satisfied) == (
            "Quick",
            "Speed",
            0.1,
            False,
        )
        command(rig, Command.HALT)
        assert [quality.active for quality in status(rig).qualities] == [False]
        assert command(rig, Command.LOAD, tree(WAIT)).qualities == ()


def test_the_status_is_published_once_a_second_and_when_the_state_changes() -> None:
    with Rig() as rig:
        published = rig.collect("mission", MissionStatus)
        run(rig, tree(WAIT))
        states = [message.state for message in published]
        assert states == [MissionState.LOADED, MissionState.RUNNING]
        rig.advance(3.05)
        assert len(published) == 5
        command(rig, Command.PAUSE)
        assert published[-1].state is MissionState.PAUSED


def test_what_happens_to_a_mission_is_told_as_events() -> None:
    with Rig() as rig:
        run(rig, tree(COUNT))
        rig.advance(0.2)
        command(rig, Command.LOAD, tree("<AlwaysFailure/>"))
        command(rig, Command.START)
        rig.advance(0.2)
        command(rig, Command.LOAD, tree(WAIT))
        command(rig, Command.START)
        command(rig, Command.HALT)
        assert kinds(rig) == [
            "mission.loaded", "mission.started", "mission.succeeded",
            "mission.loaded", "mission.started", "mission.failed",
            "mission.loaded", "mission.started", "mission.halted",
        ]  # fmt: skip
