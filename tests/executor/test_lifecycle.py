"""Missions and the life of the component that runs them."""

from __future__ import annotations

from pathlib import Path

import pytest

from behavior_tree import Status, SyncAction
from regraft.bus_schema.messages.mission import Command, MissionState, MissionStatus
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.runtime.lifecycle.lifecycle import TransitionFailed
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.source import Unloadable
from regraft.testing import Rig
from tests.executor.helpers import command, kinds, run, status, tree
from tests.executor.robot import Navigator

DRIVE = '<NavigateTo name="drive" x="3.0" y="4.0"/>'
WAIT = '<Sleep name="wait" msec="100000"/>'
PLUGIN = "tests.executor.test_lifecycle:PLUGINS"


class Broken(SyncAction):
    """A leaf with a fault."""

    def tick(self) -> Status:
        """Raise."""
        raise ZeroDivisionError("a fault in a leaf")


PLUGINS = [Broken]


@pytest.fixture
def mission(tmp_path: Path) -> str:
    """A file with a mission that drives and then waits."""
    file = tmp_path / "mission.xml"
    file.write_text(tree('<Script code="n := 1"/>', DRIVE, WAIT))
    return str(file)


def test_a_mission_starts_by_itself(mission: str) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(0.5)
        assert navigator.asked == [3.0]


def test_a_mission_that_shall_not_start_by_itself_waits_for_the_command(mission: str) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Executor, "bt_executor", {"mission": mission, "autostart": False})
        rig.advance(5.0)
        assert navigator.asked == []
        command(rig, Command.START)
        rig.advance(0.5)
        assert navigator.asked == [3.0]


def test_a_missing_mission_file_keeps_the_component_from_being_configured() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"mission": "/nowhere/mission.xml"})
        assert rig.state("bt_executor") is State.UNCONFIGURED
        fault, _ = rig.take_faults()
        assert "/nowhere/mission.xml" in fault


def test_deactivation_cancels_the_goal_and_silences_the_executor(mission: str) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        published = rig.collect("mission", MissionStatus)
        rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(1.0)
        rig.transition("bt_executor", Transition.DEACTIVATE)
        assert navigator.cancelled == [3.0]
        assert published[-1].state is MissionState.HALTED
        so_far, events = len(published), len(rig.events)
        rig.advance(10.0)
        assert (len(published), len(rig.events), navigator.asked) == (so_far, events, [3.0])


def test_activation_starts_the_interrupted_mission_again(mission: str) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(1.0)
        rig.transition("bt_executor", Transition.DEACTIVATE)
        rig.transition("bt_executor", Transition.ACTIVATE)
        rig.advance(1.0)
        assert navigator.asked == [3.0, 3.0]


def test_activation_does_not_start_a_mission_that_was_halted_by_command(mission: str) -> None:
    with Rig() as rig:
        rig.add(Navigator)
        rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(1.0)
        command(rig, Command.HALT)
        rig.transition("bt_executor", Transition.DEACTIVATE)
        rig.transition("bt_executor", Transition.ACTIVATE)
        rig.advance(1.0)
        assert status(rig).state is MissionState.HALTED


def test_an_exception_in_a_leaf_fails_the_mission_and_not_the_component() -> None:
    with Rig() as rig:
        run(rig, tree(f'<ParallelAll>{WAIT}<Broken name="culprit"/></ParallelAll>'), nodes=PLUGIN)
        rig.advance(0.5)
        failed = status(rig)
        assert failed.state is MissionState.FAILED
        assert "culprit" in failed.error
        assert "a fault in a leaf" in failed.error
        assert failed.running == ()
        assert rig.state("bt_executor") is State.ACTIVE
        (event,) = [event for event in rig.events if event.kind == "mission.failed"]
        assert event.details["node"] == "culprit"


def test_a_failed_mission_names_the_leaf_that_failed_last() -> None:
    with Rig() as rig:
        run(rig, tree("<AlwaysSuccess/>", '<AlwaysFailure name="culprit"/>'))
        rig.advance(0.5)
        assert status(rig).error == "the tree failed, last at 'culprit'"
        assert kinds(rig)[-1] == "mission.failed"


def test_a_successor_starts_the_running_mission_again_with_its_blackboard(mission: str) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        first = rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(1.0)
        state = first.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        second = rig.add(Executor, "second", {"mission": mission, "autostart": False}, state=State.INACTIVE)
        second.restore(state)
        rig.transition("second", Transition.ACTIVATE)
        rig.advance(0.5)
        assert navigator.asked == [3.0, 3.0]
        assert status(rig).blackboard["n"] == 1


def test_a_successor_has_the_tree_that_was_loaded_by_command() -> None:
    with Rig() as rig:
        first = run(rig, tree(WAIT, name="Commanded"))
        state = first.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        second = rig.add(Executor, "second", state=State.INACTIVE)
        second.restore(state)
        rig.transition("second", Transition.ACTIVATE)
        rig.advance(0.5)
        successor = status(rig)
        assert (successor.tree, successor.state) == ("Commanded", MissionState.RUNNING)


def test_a_successor_has_the_tree_of_the_missions_file_that_was_chosen_by_command(tmp_path: Path) -> None:
    file = tmp_path / "two.xml"
    file.write_text(
        '<root BTCPP_format="4" main_tree_to_execute="Patrol">'
        f'<BehaviorTree ID="Patrol">{WAIT}</BehaviorTree>'
        f'<BehaviorTree ID="Home"><Sequence><Script code="n := 3"/>{WAIT}</Sequence></BehaviorTree>'
        "</root>"
    )
    with Rig() as rig:
        first = rig.add(Executor, "bt_executor", {"mission": str(file)})
        rig.advance(0.5)
        command(rig, Command.LOAD, main="Home")
        command(rig, Command.START)
        rig.advance(0.5)
        state = first.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        second = rig.add(Executor, "second", {"mission": str(file), "autostart": False}, state=State.INACTIVE)
        second.restore(state)
        rig.transition("second", Transition.ACTIVATE)
        rig.advance(0.5)
        successor = status(rig)
        assert (successor.tree, successor.state) == ("Home", MissionState.RUNNING)
        assert successor.blackboard["n"] == 3


def test_a_successor_takes_over_after_the_incumbent_was_deactivated(mission: str) -> None:
    with Rig() as rig:
        first = rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(0.5)
        rig.transition("bt_executor", Transition.DEACTIVATE)
        state = first.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        second = rig.add(Executor, "second", {"mission": mission}, state=State.INACTIVE)
        second.restore(state)
        rig.transition("second", Transition.ACTIVATE)
        assert status(rig).state is MissionState.RUNNING


def test_a_successor_does_not_start_a_paused_mission(mission: str) -> None:
    with Rig() as rig:
        first = rig.add(Executor, "bt_executor", {"mission": mission})
        command(rig, Command.PAUSE)
        state = first.snapshot()
        rig.runtimes.pop("bt_executor").leave()
        second = rig.add(Executor, "second", {"mission": mission}, state=State.INACTIVE)
        second.restore(state)
        rig.transition("second", Transition.ACTIVATE)
        assert status(rig).state is MissionState.LOADED


def test_another_mission_file_takes_over_while_running(mission: str, tmp_path: Path) -> None:
    other = tmp_path / "other.xml"
    other.write_text(tree(WAIT, name="Other"))
    with Rig() as rig:
        navigator = rig.add(Navigator, parameters={"seconds": 100.0})
        executor = rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(0.5)
        executor.kit.parameters.set({"mission": str(other)})
        executor.on_parameters(frozenset({"mission"}))
        rig.advance(0.5)
        now = status(rig)
        assert (now.tree, now.state) == ("Other", MissionState.RUNNING)
        assert navigator.cancelled == [3.0]


def test_a_broken_mission_file_is_refused_and_the_old_mission_goes_on(mission: str, tmp_path: Path) -> None:
    other = tmp_path / "other.xml"
    other.write_text(tree("<Unknown/>"))
    with Rig() as rig:
        executor = rig.add(Executor, "bt_executor", {"mission": mission})
        rig.advance(0.5)
        executor.kit.parameters.set({"mission": str(other)})
        with pytest.raises(Unloadable, match=r"other\.xml:2: .*Unknown"):
            executor.on_parameters(frozenset({"mission"}))
        now = status(rig)
        assert (now.tree, now.state) == ("Main", MissionState.RUNNING)


def test_node_types_that_cannot_be_found_are_named() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"nodes": "no.such.module:Leaf"})
        assert rig.state("bt_executor") is State.UNCONFIGURED
        fault, _ = rig.take_faults()
        assert "no.such.module:Leaf" in fault
        with pytest.raises(TransitionFailed):
            rig.transition("bt_executor", Transition.CONFIGURE)
        assert rig.take_faults() == [fault]


def test_a_stack_can_have_mocks_take_nodes_places(mission: str, tmp_path: Path) -> None:
    rules = tmp_path / "rules.json"
    rules.write_text(
        '{"TestNodeConfigs": {"there": {"return_status": "SUCCESS"}}, "SubstitutionRules": {"drive": "there"}}'
    )
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Executor, "bt_executor", {"mission": mission, "mocks": str(rules)})
        rig.advance(0.5)
        assert navigator.asked == []
        assert status(rig).running == ("wait",)


def test_faulty_mocks_keep_the_component_from_being_configured(mission: str, tmp_path: Path) -> None:
    rules = tmp_path / "rules.json"
    rules.write_text('{"SubstitutionRules": {"drive": "AlwaysSucces"}}')
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"mission": mission, "mocks": str(rules)})
        assert rig.state("bt_executor") is State.UNCONFIGURED
        fault, _ = rig.take_faults()
        assert "did you mean 'AlwaysSuccess'?" in fault
