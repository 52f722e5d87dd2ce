"""The tree decorator: when its child is ticked, what it asks for, and how it ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from regraft.bus_schema.messages.management.objectives import CurvePoint, Objective, ObjectiveState, Progress
from regraft.bus_schema.messages.mission import Command, MissionCommand, MissionState, MissionStatus
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.model.qualities.bounds import Comparison
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, refusal, run, status, tree
from tests.executor.robot import Navigator
from tests.metacontrol.objectives.small_metacontroller import SmallMetacontroller

DRIVE = '<NavigateTo name="drive" x="1" y="2"/>'
OUTPUTS = " ".join(f'{port}="{{{port}}}"' for port in ("status", "realization_out", "mode_out", "qualities", "reasons"))


def objective(ports: str = "", child: str = DRIVE, name: str = "patrol", skill: str = "to_navigate") -> str:
    """Return the XML of the decorator."""
    return f'<Objective name="{name}" skill="{skill}" {OUTPUTS} {ports}>{child}</Objective>'


class Bench:
    """A metacontroller that grounds by hand, a navigator that takes 2 s, and a mission."""

    def __init__(self, rig: Rig, small: SmallMetacontroller, navigator: Navigator) -> None:
        self.rig = rig
        self.small = small
        self.navigator = navigator

    def board(self) -> dict[str, Any]:
        """Return the blackboard."""
        return status(self.rig).blackboard

    def state(self) -> MissionState:
        """Return the state of the mission."""
        return status(self.rig).state

    def after(self, seconds: float) -> MissionState:
        """Let time pass; returns the state of the mission."""
        self.rig.advance(seconds)
        return self.state()

    def ground(self, realization: str = "fast", **measured: float) -> None:
        """Provide the objective, and let everybody notice."""
        self.small.ground("patrol", realization, **measured)
        self.rig.advance(0.3)


@contextmanager
def bench(*nodes: str, failures: int = 0, by_hand: bool = True) -> Iterator[Bench]:
    """Run a mission for 0.3 s."""
    with Rig() as rig:
        small = rig.add(SmallMetacontroller, "metacontrol", {"by_hand": by_hand})
        navigator = rig.add(Navigator, parameters={"failures": failures})
        run(rig, tree(*(nodes or (objective(),))))
        rig.advance(0.3)
        yield Bench(rig, small, navigator)


def test_the_objective_has_what_the_ports_give() -> None:
    ports = (
        'requirements="safety: 0.5, energy &lt;= 0.4" priority="2" always_improve="true" realization="careful" '
        """task="rounds" inputs='json:{"goal": "{place}", "rounds": 3}'"""
    )
    with bench("<Script code=\"place := 'north'\"/>", objective(ports)) as at:
        assert at.small.given["patrol"] == Objective(
            "to_navigate",
            "patrol",
            {"safety": 0.5, "energy": 0.4},
            2.0,
            True,
            realization="careful",
            inputs={"goal": "north", "rounds": 3},
            task="rounds",
            operators={"energy": Comparison.AT_MOST},
        )


def test_the_objective_has_weights_and_curves_of_its_own() -> None:
    curves = {
        "safety": (CurvePoint(0.0, 0.0), CurvePoint(0.5, 0.2)),
        "energy": (CurvePoint(0.0, 1.0), CurvePoint(1.0, 0.0)),
    }
    for ports in (
        'weights="safety: 2, energy: 1" curves="safety=0:0,0.5:0.2; energy=0:1,1:0"',
        """weights='json:{"safety": 2, "energy": 1}' """
        """curves='json:{"safety": [[0, 0], [0.5, 0.2]], "energy": [[0, 1], [1, 0]]}'""",
    ):
        with bench(objective(ports)) as at:
            given = at.small.given["patrol"]
            assert (given.weights, given.curves) == ({"safety": 2.0, "energy": 1.0}, curves)


def test_without_a_name_the_objective_has_that_of_its_skill() -> None:
    with bench(f'<Objective skill="to_navigate">{DRIVE}</Objective>') as at:
        assert list(at.small.given) == ["to_navigate"]


def test_the_child_waits_for_a_realization_and_its_success_ends_the_objective() -> None:
    with bench() as at:
        assert at.after(3.0) is MissionState.RUNNING
        assert at.navigator.asked == []
        assert at.board()["status"] == "UNGROUNDED"
        at.ground("fast", safety=0.6)
        assert at.navigator.asked == [1.0]
        assert {port: at.board()[port] for port in ("status", "realization_out", "mode_out", "qualities")} == {
            "status": "IN_PROGRESS",
            "realization_out": "fast",
            "mode_out": "to_navigate.fast",
            "qualities": {"safety": 0.6},
        }
        assert at.after(3.0) is MissionState.SUCCEEDED
        assert at.small.log == ["add patrol", "end patrol SUCCESS"]


def test_the_childs_failure_is_reported_as_an_error_and_returned() -> None:
    with bench(failures=1) as at:
        at.ground()
        assert at.after(3.0) is MissionState.FAILED
        assert at.small.log == ["add patrol", "end patrol ERROR"]


def test_a_skill_without_such_a_result_is_cancelled_when_the_child_has_ended() -> None:
    with bench(objective(skill="to_detect"), by_hand=False) as at:
        assert at.after(3.0) is MissionState.SUCCEEDED
        assert at.small.log == ["add patrol", "end patrol INPROGRESS"]


def test_objectives_one_after_the_other_do_not_overlap() -> None:
    with bench(objective(name="one"), objective(name="two"), by_hand=False) as at:
        assert at.after(6.0) is MissionState.SUCCEEDED
        assert at.small.log == ["add one", "end one SUCCESS", "add two", "end two SUCCESS"]


def test_a_halt_cancels_the_objective_and_the_child() -> None:
    with bench() as at:
        at.ground()
        command(at.rig, Command.HALT)
        at.rig.advance(0.3)
        assert at.small.log == ["add patrol", "end patrol INPROGRESS"]
        assert at.navigator.cancelled == [1.0]
        command(at.rig, Command.START)
        at.rig.advance(0.3)
        assert at.small.log[2:] == ["add patrol"]


def test_an_error_with_a_realization_in_force_leaves_the_child_at_work() -> None:
    with bench() as at:
        at.ground()
        at.small.break_down("patrol", ObjectiveState.IN_ERROR_NFR, "safety is 0.4, must be >= 0.5", stays=True)
        at.rig.advance(0.3)
        assert (at.board()["status"], at.board()["realization_out"]) == ("IN_ERROR_NFR", "fast")
        assert at.board()["reasons"] == "safety is 0.4, must be >= 0.5"
        assert at.navigator.cancelled == []
        assert at.after(3.0) is MissionState.SUCCEEDED


def test_without_a_realization_the_child_is_halted_and_starts_again_with_the_next_one() -> None:
    with bench() as at:
        at.ground()
        at.small.break_down("patrol", ObjectiveState.IN_ERROR_COMPONENT, "the laser has failed")
        assert at.after(0.3) is MissionState.RUNNING
        assert at.navigator.cancelled == [1.0]
        assert (at.board()["status"], at.board()["realization_out"]) == ("IN_ERROR_COMPONENT", "")
        at.ground("careful")
        assert at.navigator.asked == [1.0, 1.0]
        assert at.after(3.0) is MissionState.SUCCEEDED


@pytest.mark.parametrize("state", [ObjectiveState.IN_ERROR_FR, ObjectiveState.IN_ERROR_NFR])
def test_an_error_without_a_realization_fails_the_decorator_where_that_is_wanted(state: ObjectiveState) -> None:
    with bench(objective('on_error="fail"')) as at:
        assert at.after(2.0) is MissionState.RUNNING
        at.ground()
        at.small.break_down("patrol", state, "no realization is left", stays=True)
        assert at.after(0.3) is MissionState.RUNNING
        at.small.break_down("patrol", state, "no realization is left")
        assert at.after(0.3) is MissionState.FAILED
        assert at.board()["reasons"] == "no realization is left"
        assert at.navigator.cancelled == [1.0]
        assert at.small.log == ["add patrol", "end patrol INPROGRESS"]


@pytest.mark.parametrize(
    ("progress", "expected", "reason"),
    [
        (Progress.SUCCESS, MissionState.SUCCEEDED, ""),
        (Progress.ERROR, MissionState.FAILED, "its skill has ended in error"),
        (Progress.INPROGRESS, MissionState.FAILED, "cancelled by another client"),
    ],
)
def test_an_objective_that_somebody_else_ends_ends_the_child(
    progress: Progress, expected: MissionState, reason: str
) -> None:
    with bench() as at:
        at.ground()
        at.small.end("patrol", progress)
        assert at.after(0.3) is expected
        assert reason in at.board()["reasons"]
        assert at.navigator.cancelled == [1.0]


def test_an_objective_that_is_refused_fails_with_the_reason() -> None:
    with bench(objective(skill="to_navigat")) as at:
        assert at.after(0.3) is MissionState.FAILED
        assert "skill: there is no skill 'to_navigat'; did you mean 'to_navigate'?" in at.board()["reasons"]
        assert at.small.log == []


def test_a_metacontroller_that_is_lost_fails_nothing_and_is_asked_again_when_it_is_back() -> None:
    with bench(objective('retry_after="200ms"')) as at:
        at.ground()
        at.rig.transition("metacontrol", Transition.DEACTIVATE)
        at.small.log.clear()
        assert at.after(0.5) is MissionState.RUNNING
        assert "metacontrol is inactive" in at.board()["reasons"]
        assert at.board()["realization_out"] == "fast"
        at.rig.transition("metacontrol", Transition.ACTIVATE)
        at.rig.advance(0.4)
        assert at.small.log == ["add patrol"]
        assert at.navigator.cancelled == [1.0], "the new run provides nothing yet"
        at.ground()
        assert at.after(3.0) is MissionState.SUCCEEDED
        assert at.small.log == ["add patrol", "end patrol SUCCESS"]


def test_a_child_that_ends_while_the_metacontroller_is_lost_has_its_own_result() -> None:
    with bench() as at:
        at.ground()
        at.rig.transition("metacontrol", Transition.DEACTIVATE)
        assert at.after(3.0) is MissionState.SUCCEEDED
        assert at.navigator.reached == [1.0]


@pytest.mark.parametrize(("on_error", "expected"), [("wait", MissionState.RUNNING), ("fail", MissionState.FAILED)])
def test_a_metacontroller_that_is_not_there_yet_is_waited_for_or_fails_the_decorator(
    on_error: str, expected: MissionState
) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        run(rig, tree(objective(f'on_error="{on_error}" accept_within="1s"')))
        rig.advance(2.5)
        assert status(rig).state is expected
        assert "nobody offers this service" in status(rig).blackboard["reasons"]
        if expected is MissionState.RUNNING:
            rig.add(SmallMetacontroller, "metacontrol")
            rig.advance(5.0)
            assert status(rig).state is MissionState.SUCCEEDED
            assert navigator.reached == [1.0]


def test_another_objective_of_the_name_is_waited_for_as_long_as_it_may_be_ending() -> None:
    other = Objective("to_navigate", "patrol", {"safety": 0.2})
    for ends in (True, False):
        with Rig() as rig:
            small = rig.add(SmallMetacontroller, "metacontrol")
            rig.add(Navigator)
            small._take(other)
            run(rig, tree(objective('retry_after="200ms"')))
            rig.advance(0.5)
            assert status(rig).state is MissionState.RUNNING
            if ends:
                small.end("patrol")
            rig.advance(4.0)
            assert status(rig).state is (MissionState.SUCCEEDED if ends else MissionState.FAILED)
            assert ends or "another objective 'patrol'" in status(rig).blackboard["reasons"]


def test_a_silent_report_delays_the_end_by_its_timeout_alone() -> None:
    with bench(objective('timeout="1s"')) as at:
        at.ground()
        at.rig.advance(1.5)
        at.rig.transition("metacontrol", Transition.DEACTIVATE)
        assert at.after(3.0) is MissionState.SUCCEEDED


def test_the_metacontroller_of_a_robot_has_a_short_name_in_its_mission() -> None:
    with Rig() as rig:
        small = rig.add(SmallMetacontroller, "left.metacontrol", scope="left")
        rig.add(Navigator, "left.navigator", scope="left")
        rig.add(Executor, "left.bt_executor", {"autostart": False}, scope="left")
        for what, text in ((Command.LOAD, tree(objective())), (Command.START, "")):
            rig.call("left/mission/command", MissionCommand(what, text, ""), MissionStatus)
        rig.advance(4.0)
        assert small.log == ["add patrol", "end patrol SUCCESS"]


@pytest.mark.parametrize(
    ("ports", "reason"),
    [
        ('requirements="safety"', "port 'requirements': 'safety' must look like"),
        ('requirements="safety: 1, safety: 2"', "safety: has two numbers"),
        ('weights="safety &gt;= 2"', "port 'weights': safety: a weight is written with ':' or '='"),
        ('weights="safety: 1, safety: 2"', "port 'weights': safety: has two"),
        ('curves="safety=0:0,0.5"', "port 'curves': safety: '0.5' must look like VALUE:UTILITY"),
        ('curves="safety: 1"', "must look like QUALITY=VALUE:UTILITY,VALUE:UTILITY"),
        ('curves="safety=0:0; safety=1:1"', "port 'curves': a quality has two curves"),
        ("curves='json:{\"safety\": [[0, 1], 2]}'", "port 'curves': safety: '2' must look like VALUE:UTILITY"),
        ('on_error="fial"', "there is no 'fial'; did you mean 'fail'?"),
        ('timeout="soon"', "port 'timeout': 'soon' is no duration"),
        ('retry_after="-1"', "port 'retry_after'"),
        ('planner="a b"', "port 'planner': 'a b' cannot be a planner's name"),
        ("inputs='{\"goal\": 1}'", "write json: before"),
        ("inputs='json:[1]'", "port 'inputs' must hold a map"),
        ('requirement="safety: 1"', "requirement"),
    ],
)
def test_a_port_that_makes_no_sense_is_refused_when_the_tree_is_loaded(ports: str, reason: str) -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"autostart": False})
        assert reason in refusal(rig, Command.LOAD, tree(objective(ports)))


def test_a_decorator_without_a_skill_or_a_child_is_refused() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"autostart": False})
        assert "needs the port skill" in refusal(rig, Command.LOAD, tree(f"<Objective>{DRIVE}</Objective>"))
        assert "exactly 1 child" in refusal(rig, Command.LOAD, tree('<Objective skill="to_navigate"/>'))


def test_an_entry_that_makes_no_sense_fails_the_decorator_with_the_reason() -> None:
    nodes = ("<Script code=\"wanted := 'safety'\"/>", objective('requirements="{wanted}"'))
    with bench(*nodes) as at:
        assert at.state() is MissionState.FAILED
        assert "'safety' must look like" in at.board()["reasons"]
        assert at.small.log == []


def test_an_inactive_executor_gives_its_objectives_up() -> None:
    with bench() as at:
        at.ground()
        at.rig.transition("bt_executor", Transition.DEACTIVATE)
        at.rig.advance(0.3)
        assert at.rig.state("bt_executor") is State.INACTIVE
        assert at.small.log == ["add patrol", "end patrol INPROGRESS"]
