"""Adaptations that fail, a manager that does not answer, and a reasoner that raises."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.control.keeping import FILE
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.bus_schema.messages.management.objectives import Objective, ObjectiveState
from regraft.bus_schema.model.adaptation import ChangeState, SetParameters
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.metacontrol.control.bench import PATROL, SKILLS, BreakableReasoner, perform
from tests.metacontrol.control.parts import PLANNER, Director


def test_a_design_that_cannot_be_entered_rests_and_the_next_is_tried_in_the_same_cycle(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = (await director.add(PATROL)).objectives[0]
        assert (found.realization, found.state) == ("energy_saving", ObjectiveState.IN_PROGRESS)
        assert [each.realization for each in found.attempts] == ["normal", "slow"]
        assert all("the motor is blocked" in each.why for each in found.attempts)
        resting = (await director.all()).resting
        assert sorted(resting) == ["patrol: normal", "patrol: slow"]

    perform(tmp_path, script, parts={"battery": "stubborn: true"})


def test_a_design_is_chosen_again_after_its_rest_when_the_objective_always_improves(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(replace(PATROL, always_improve=True))
        assert (await director.status("patrol")).realization == "energy_saving"
        await director.adapt(SetParameters("battery", {"stubborn": False}))
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "energy_saving"
        await director.wait(2.5)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, parts={"battery": "stubborn: true"}, parameters={"first_rest": 3.0})


def test_where_every_design_fails_to_be_entered_the_objective_says_so(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = (await director.add(PATROL)).objectives[0]
        assert (found.realization, found.state) == ("", ObjectiveState.IN_ERROR_NFR)
        assert "it rests for" in found.reasons[0]
        assert director.states()["laser"] is not State.ACTIVE

    perform(tmp_path, script, parts={"controller": "stubborn: true"})


def test_a_reasoner_that_fails_saves_the_knowledge_base_and_the_loop_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reasoner = BreakableReasoner(monkeypatch)
    error = RecursionError("the rules are too deep")

    async def script(director: Director) -> None:
        await director.add(PATROL)
        reasoner.error = error
        await director.break_part("laser")
        await director.wait(1.0)
        status = await director.status("patrol")
        assert status.reasons[0] == "the reasoner failed: RecursionError: the rules are too deep"
        assert status.realization == "normal"
        reasoner.error = None
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, status.reasons) == ("degraded", ())

    perform(tmp_path, script)
    assert load([tmp_path / FILE]).facts


def test_a_disk_that_is_full_while_saving_does_not_end_the_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reasoner = BreakableReasoner(monkeypatch, ValueError("no conclusion"))

    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.told("metacontrol.reasoner_failed", "could not be saved")
        reasoner.error = None
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, parameters={"saved_in": "/dev/full/folder"})


def test_a_rest_that_the_manager_refuses_is_announced_once_though_it_is_tried_again(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.adapt(ChangeState("dock", Transition.DEACTIVATE))
        await director.cancel("patrol", wait=False)
        await director.wait(2.0)
        refused = "constraints.0: at least one of laser, dock must be active, but none is"
        events = await director.told("metacontrol.not_adapted")
        assert events == [f"the adaptation manager has not changed what was asked for: {refused}"]
        assert len(await director.entered()) > 3
        assert director.states()["laser"] is State.ACTIVE
        await director.add(PATROL)
        assert (await director.status("patrol")).reasons == ()

    perform(tmp_path, script, active=("dock",), more="constraints: [{at_least_one_active: [laser, dock]}]")


def test_without_a_design_the_robot_rests_or_keeps_what_it_has(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        director.report_component("camera", "FALSE")
        await director.break_part("laser")
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, status.state) == ("normal", ObjectiveState.IN_ERROR_COMPONENT)
        assert director.states()["controller"] is State.ACTIVE

    perform(tmp_path, script, parameters={"without_design": "keep"})


def test_a_design_that_is_kept_keeps_what_it_requires(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(Objective("to_recharge", "charge"))
        director.report_component("camera", "FALSE")
        await director.break_part("laser")
        await director.wait(1.0)
        status = await director.status("charge")
        assert (status.realization, status.state) == ("docking", ObjectiveState.IN_ERROR_COMPONENT)
        states = director.states()
        assert (states["dock"], states["controller"]) == (State.ACTIVE, State.ACTIVE)
        assert "to_navigate.__DEFAULT__" not in [mode for modes in await director.entered() for mode in modes]

    perform(tmp_path, script, parameters={"without_design": "keep"})


def test_a_design_that_is_kept_gives_up_what_it_requires_to_another_objective(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(Objective("to_recharge", "charge"))
        await director.break_part("dock")
        await director.wait(1.0)
        status = await director.status("charge")
        assert (status.realization, status.state) == ("docking", ObjectiveState.IN_ERROR_COMPONENT)
        assert director.states()["controller"] is State.ACTIVE
        await director.add(PATROL)
        assert (await director.status("patrol")).mode == "to_navigate.normal"
        assert (await director.status("charge")).realization == "docking"
        assert await director.entered() == [["to_recharge.docking", "to_navigate.performance"], ["to_navigate.normal"]]

    seen = SKILLS.replace("Component dock {", "Component dock observable {")
    perform(tmp_path, script, skills=seen, parameters={"without_design": "keep"})


def test_while_it_is_inactive_the_robot_goes_on_with_what_stands(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        goal = director.pursue(PATROL)
        await director.wait(1.0)
        await director.adapt(ChangeState(PLANNER, Transition.DEACTIVATE))
        await director.break_part("laser")
        await director.wait(2.0)
        assert director.states()["controller"] is State.ACTIVE
        assert await director.entered() == [["to_navigate.normal"]]
        await director.adapt(ChangeState(PLANNER, Transition.ACTIVATE))
        assert goal is not None
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "degraded"
        await director.wait(3.0)
        assert (await director.all()).objectives == ()

    perform(tmp_path, script, parameters={"orphan_after": 3.0})


def test_a_design_that_fails_right_after_a_recovery_rests_and_the_next_is_tried(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        assert (await director.status("patrol")).realization == "degraded"
        director.report_component("laser", "FALSE")
        await director.wait(1.0)
        before = len(await director.entered())
        director.report_component("laser", "RECOVERED")
        await director.wait(2.0)
        assert (await director.status("patrol")).realization == "degraded"
        tried = (await director.entered())[before:]
        assert tried == [["to_navigate.normal"], ["to_navigate.slow"], ["to_navigate.energy_saving"]]
        assert sorted((await director.all()).resting) == ["patrol: energy_saving", "patrol: normal", "patrol: slow"]

    fast = SKILLS.replace(
        "Component laser observable { Configuration active }",
        "Component laser observable { Configuration active { speed: 0.5 } }",
    )
    perform(tmp_path, script, skills=fast, more="constraints: [{parameter: laser.speed, at_most: 0.4}]")


def test_the_rest_of_a_design_that_was_rolled_back_ends_when_the_component_to_blame_recovers(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = (await director.add(PATROL)).objectives[0]
        assert (found.realization, found.state) == ("degraded", ObjectiveState.IN_PROGRESS)
        director.report_component("laser", "FALSE")
        await director.wait(1.0)
        await director.adapt(SetParameters("laser", {"stubborn": False}))
        director.report_component("laser", "RECOVERED")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, parts={"laser": "stubborn: true"})


def test_a_design_that_is_rolled_back_right_after_a_recovery_rests_and_the_next_is_tried(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        director.report_component("laser", "FALSE")
        await director.wait(1.0)
        await director.adapt(SetParameters("laser", {"stubborn": True}))
        before = len(await director.entered())
        director.report_component("laser", "RECOVERED")
        await director.wait(2.0)
        assert (await director.status("patrol")).realization == "degraded"
        tried = (await director.entered())[before:]
        assert tried == [["to_navigate.normal"], ["to_navigate.slow"], ["to_navigate.energy_saving"]]

    perform(tmp_path, script)


def test_the_recovery_of_another_component_leaves_a_design_that_was_rolled_back_at_rest(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        director.report_component("battery", "FALSE")
        await director.wait(1.0)
        director.report_component("battery", "RECOVERED")
        await director.wait(1.0)
        assert sorted((await director.all()).resting) == ["patrol: energy_saving", "patrol: normal", "patrol: slow"]

    perform(tmp_path, script, parts={"laser": "stubborn: true"})
