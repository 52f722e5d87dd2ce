"""Cancelling works at any moment, and nothing that was cancelled is activated again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.management.objectives import Objective, ObjectiveState
from regraft.bus_schema.model.adaptation import EnterMode, SetParameters, Swap
from regraft.bus_schema.model.lifecycle import State
from tests.metacontrol.control.bench import PATROL, perform
from tests.metacontrol.control.parts import PLANNER, Director


def test_an_objective_that_is_cancelled_while_its_design_is_being_entered_comes_to_rest(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        for _ in range(5):
            await director.add(PATROL, wait=False)
            await director.cancel("patrol", wait=False)
            await director.wait(0.3)
            assert director.states()["controller"] is not State.ACTIVE
        await director.wait(2.0)
        assert director.states()["controller"] is not State.ACTIVE
        assert (await director.all()).objectives == ()

    perform(tmp_path, script)


def test_an_objective_that_was_never_grounded_can_be_cancelled(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        impossible = replace(PATROL, requirements={"safety": 0.99})
        found = (await director.add(impossible)).objectives[0]
        assert (found.state, found.realization) == (ObjectiveState.IN_ERROR_NFR, "")
        assert any("must be >= 0.99" in reason for reason in found.reasons)
        assert (await director.cancel("patrol")).objectives == ()
        assert await director.entered() == []

    perform(tmp_path, script)


def test_an_unknown_objective_is_not_cancelled_and_the_nearest_is_named(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        with pytest.raises(CallFailed) as refused:
            await director.cancel("patrl")
        assert refused.value.code is RefusalCode.NOT_FOUND
        assert "did you mean 'patrol'" in refused.value.why
        with pytest.raises(CallFailed) as refused:
            await director.cancel("patrol", "a task")
        assert refused.value.code is RefusalCode.MALFORMED

    perform(tmp_path, script)


def test_a_task_ends_with_all_its_objectives_and_leaves_those_of_others(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        place = replace(PATROL, name="place_1", task="place_1")
        await director.add(place, replace(place, name="place_1_safely", requirements={"safety": 0.7}))
        await director.add(replace(PATROL, name="other"))
        left = await director.cancel(task="place_1")
        assert [each.objective for each in left.objectives] == ["other"]
        assert director.states()["controller"] is State.ACTIVE
        with pytest.raises(CallFailed) as refused:
            await director.cancel(task="place_1")
        assert refused.value.code is RefusalCode.NOT_FOUND

    perform(tmp_path, script)


def test_two_objectives_on_one_design_end_apart(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = await director.add(PATROL, replace(PATROL, name="inspect"))
        assert [each.realization for each in found.objectives] == ["normal", "normal"]
        await director.cancel("patrol")
        assert director.states()["controller"] is State.ACTIVE
        await director.cancel("inspect")
        assert director.states()["controller"] is State.INACTIVE
        assert await director.entered() == [["to_navigate.normal"], ["to_navigate.__DEFAULT__"]]

    perform(tmp_path, script)


@pytest.mark.parametrize("swapped", [False, True])
def test_a_design_that_the_manager_enters_after_it_was_given_up_comes_to_rest(tmp_path: Path, swapped: bool) -> None:
    async def script(director: Director) -> None:
        await director.adapt(SetParameters("dock", {"speed": 0.3}), confirm=6.0, wait=False)
        await director.wait(0.2)
        await director.add(PATROL, wait=False)
        await director.until(1.5)
        await director.cancel("patrol", wait=False)
        if swapped:
            await director.adapt(Swap(PLANNER), wait=False)
        await director.until(5.5)
        assert await director.entered() == [], "the manager is busy"
        await director.until(10.0)
        entered = await director.entered()
        assert (entered[0], entered[-1]) == (["to_navigate.normal"], ["to_navigate.__DEFAULT__"])
        used = ("controller", "navigator", "laser", "battery")
        assert not [name for name in used if director.states()[name] is State.ACTIVE]

    perform(tmp_path, script, parameters={"adapt_within": 1.0})


def test_a_design_that_others_enter_long_after_it_was_given_up_is_left_to_them(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        held = await director.adapt(SetParameters("dock", {"speed": 0.3}), confirm=6.0, wait=False)
        await director.wait(0.2)
        await director.add(PATROL, wait=False)
        await director.until(1.5)
        await director.cancel("patrol", wait=False)
        await director.until(3.0)
        await director.withdraw(held.id)  # what waits was asked for on a revision that there is no more
        await director.until(4.0)
        assert director.states()["controller"] is not State.ACTIVE
        await director.adapt(EnterMode("to_navigate.normal"))
        await director.until(6.0)
        assert director.states()["controller"] is State.ACTIVE

    perform(tmp_path, script, parameters={"adapt_within": 1.0})


def test_cancels_in_a_storm_of_failures_leave_nothing_active(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        for index in range(12):
            await director.add(replace(PATROL, name=f"patrol_{index}"), wait=False)
            director.report_component("laser", "FALSE" if index % 2 else "RECOVERED")
            director.report_component("camera", "RECOVERED" if index % 3 else "FALSE")
            if index:
                await director.cancel(f"patrol_{index - 1}", wait=False)
            await director.wait(0.05)
        await director.cancel("patrol_11")
        await director.wait(1.0)
        assert (await director.all()).objectives == ()
        used = ("controller", "navigator", "laser", "camera", "battery")
        assert not [name for name in used if director.states()[name] is State.ACTIVE]

    perform(tmp_path, script)


def test_a_goal_that_its_client_cancels_ends_the_objective(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        goal = director.pursue(PATROL)
        await director.wait(1.0)
        assert goal.feedback is not None
        assert (goal.feedback.realization, goal.feedback.state) == ("normal", ObjectiveState.IN_PROGRESS)
        goal.cancel()
        await director.wait(1.0)
        assert (await director.all()).objectives == ()
        assert director.states()["controller"] is State.INACTIVE

    perform(tmp_path, script)


def test_an_objective_is_refused_under_a_name_that_another_has(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.add(PATROL)
        with pytest.raises(CallFailed) as refused:
            await director.add(Objective("to_navigate", "more"), replace(PATROL, requirements={"safety": 0.6}))
        assert (refused.value.code, refused.value.field) == (RefusalCode.CONFLICT, "objectives.1.name")
        assert [each.objective for each in (await director.all()).objectives] == ["patrol"]

    perform(tmp_path, script)
