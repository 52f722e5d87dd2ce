"""The published decisions, by parts that fail and recover while the robot is up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from regraft.bus_schema.messages.management.objectives import Objective, ObjectiveState
from regraft.bus_schema.model.lifecycle import State
from tests.metacontrol.control.bench import PATROL, perform
from tests.metacontrol.control.parts import Director


async def _realization(director: Director, seconds: float = 1.0) -> str:
    await director.wait(seconds)
    return (await director.status("patrol")).realization


def test_the_published_decisions_follow_failures_and_recoveries(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = (await director.add(PATROL)).objectives[0]
        assert (found.realization, found.state) == ("normal", ObjectiveState.IN_PROGRESS)
        await director.break_part("laser")
        assert await _realization(director) == "degraded"
        assert director.states()["camera"] is State.ACTIVE
        director.mend("laser")
        assert await _realization(director) == "normal"
        assert director.states()["camera"] is State.INACTIVE
        await director.break_part("battery")
        assert await _realization(director) == "energy_saving"
        await director.break_part("laser")
        assert await _realization(director) == "degraded_energy_save"
        await director.break_part("camera")
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, status.state) == ("", ObjectiveState.IN_ERROR_COMPONENT)
        assert director.states()["controller"] is State.INACTIVE
        for name in ("camera", "laser", "battery"):
            director.mend(name)
        assert await _realization(director) == "normal"

    perform(tmp_path, script)


def test_a_failure_of_its_own_that_an_observer_holds_for_over_is_tried_again_until_the_next(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.break_part("laser")
        assert await _realization(director) == "degraded"
        director.report_component("laser", "TRUE")
        assert await _realization(director) == "degraded", "normal operation is no recovery of what has failed"
        director.report_component("laser", "RECOVERED")
        assert await _realization(director) == "normal"
        assert director.states()["laser"] is State.ACTIVE
        await director.break_part("laser")
        assert await _realization(director) == "degraded"

    perform(tmp_path, script)


def test_a_looser_bound_has_the_faster_realization(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = await director.add(replace(PATROL, requirements={"energy": 0.8}))
        assert found.objectives[0].realization == "performance"

    perform(tmp_path, script)


def test_a_quality_that_is_missed_for_a_while_has_another_realization_chosen(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        for _ in range(3):
            director.report("safety", 0.49)
            await director.wait(0.5)
        status = await director.status("patrol")
        assert status.realization == "slow"
        assert [each.realization for each in status.attempts] == ["normal"]
        assert "safety" in status.attempts[0].why

    perform(tmp_path, script)


def test_cancelling_leads_to_rest(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        assert director.states()["controller"] is State.ACTIVE
        assert (await director.cancel("patrol")).objectives == ()
        assert {name: state for name, state in director.states().items() if name in ("laser", "controller")} == {
            "laser": State.INACTIVE,
            "controller": State.INACTIVE,
        }
        assert await director.entered() == [["to_navigate.normal"], ["to_navigate.__DEFAULT__"]]

    perform(tmp_path, script)


def test_a_required_skill_is_provided_in_the_same_adaptation_and_ends_with_it(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = await director.add(Objective("to_recharge", "dock", {"safety": 0.5}))
        assert [(each.objective, each.realization, each.parent) for each in found.objectives] == [
            ("dock", "docking", ""),
            ("dock/docking_requires_to_navigate", "performance", "dock"),
        ]
        assert [sorted(each) for each in await director.entered()] == [
            ["to_navigate.performance", "to_recharge.docking"]
        ]
        await director.break_part("laser")
        await director.wait(1.0)
        assert [each.realization for each in (await director.all()).objectives] == ["docking", "degraded"]
        director.report_component("camera", "FALSE")
        await director.wait(1.0)
        status = await director.status("dock")
        assert (status.realization, status.state) == ("", ObjectiveState.IN_ERROR_COMPONENT)
        assert "it requires to_navigate" in status.reasons[0]
        director.report_component("camera", "RECOVERED")
        await director.wait(1.0)
        assert [each.realization for each in (await director.all()).objectives] == ["docking", "degraded"]
        await director.cancel("dock")
        assert director.states()["controller"] is State.INACTIVE
        assert director.states()["dock"] is State.INACTIVE

    perform(tmp_path, script)
