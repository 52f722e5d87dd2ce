"""Skills that share components, and components that are removed from the stack while objectives need them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.objectives import Objective, ObjectiveState
from regraft.bus_schema.model.adaptation import Add, EnterMode, Remove, SetParameters
from regraft.bus_schema.model.lifecycle import State
from tests.metacontrol.control.bench import PATROL, SKILLS, perform
from tests.metacontrol.control.parts import Director, Part

WATCH = (
    SKILLS
    + """\
Skill to_watch { quality attributes [safety] }
Realization by_camera of to_watch {
  Component camera active, Component dock active
  Quality [safety: 0.9]; context: Default
};
"""
)
WATCHING = replace(PATROL, skill="to_watch", name="watch", requirements={})


def test_a_realization_of_which_others_claim_a_component_is_entered_once(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL, WATCHING)
        before = await director.status("patrol")
        await director.wait(3.0)
        assert len(await director.entered()) == 1
        assert (await director.status("patrol")).since == before.since
        assert director.states()["camera"] is State.ACTIVE
        await director.cancel("watch")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"
        assert director.states()["camera"] is State.INACTIVE

    perform(tmp_path, script, skills=WATCH)


def test_a_realization_that_others_enter_is_taken_over_though_another_was_entered_in_part(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL, WATCHING)
        await director.adapt(EnterMode("to_navigate.degraded"))
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "degraded"
        assert director.states()["controller"] is State.ACTIVE

    perform(tmp_path, script, skills=WATCH)


SHARING_LASER = """\
import "navigation_definitions.skills"
Component laser observable { Configuration active }
Realization normal of to_navigate {
  Component navigator active, Component controller active, Component laser active
  Quality [safety: 0.8, performance: 0.7, energy: 0.5]; context: Default
};
Realization docking of to_recharge {
  Component dock { Configuration active { speed: 0.05 } }, Component laser active
  Quality [safety: 0.8, energy: 0.1]; context: Default
};
"""
NO_RESTS = """\
modes:
  to_navigate.normal:
    - {change: transition, component: navigator, transition: activate}
    - {change: transition, component: controller, transition: activate}
    - {change: transition, component: laser, transition: activate}
  to_recharge.docking:
    - {change: set_parameters, component: dock, parameters: {speed: 0.05}}
    - {change: transition, component: dock, transition: activate}
    - {change: transition, component: laser, transition: activate}
"""
NAVIGATE, RECHARGE = Objective("to_navigate", "patrol"), Objective("to_recharge", "dock_it")
OF_PATROL = ("navigator", "controller", "laser")


@pytest.mark.parametrize("modes", ["", NO_RESTS])
def test_an_objective_that_ended_while_another_used_its_component_can_be_asked_for_again(
    tmp_path: Path, modes: str
) -> None:
    async def script(director: Director) -> None:
        await director.add(NAVIGATE, RECHARGE)
        await director.cancel("patrol")
        states = director.states()
        assert [states[name] for name in OF_PATROL] == [State.INACTIVE, State.INACTIVE, State.ACTIVE]
        found = await director.add(NAVIGATE)
        assert [each.state for each in found.objectives if each.objective == "patrol"] == [ObjectiveState.IN_PROGRESS]
        assert {director.states()[name] for name in OF_PATROL} == {State.ACTIVE}
        count = len(await director.entered())
        await director.wait(3.0)
        assert len(await director.entered()) == count

    perform(tmp_path, script, skills=SHARING_LASER, modes=modes)


def test_a_skill_without_a_mode_for_its_rest_comes_to_rest_and_blocks_no_other(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(NAVIGATE)
        await director.cancel("patrol")
        assert {director.states()[name] for name in OF_PATROL} == {State.INACTIVE}
        found = await director.add(RECHARGE)
        assert [(each.realization, each.reasons) for each in found.objectives] == [("docking", ())]
        assert director.states()["dock"] is State.ACTIVE
        await director.cancel("dock_it")
        await director.add(NAVIGATE)
        assert {director.states()[name] for name in OF_PATROL} == {State.ACTIVE}
        assert director.states()["dock"] is State.INACTIVE

    perform(tmp_path, script, skills=SHARING_LASER, modes=NO_RESTS)


def test_a_component_that_is_removed_has_failed_until_it_is_added_again(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        spec = director.system.architecture.components["laser"]
        await director.adapt(Remove("laser"))
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, [each.realization for each in status.attempts]) == ("degraded", ["normal"])
        await director.wait(2.0)
        assert len(await director.entered()) == 2
        await director.adapt(Add("laser", spec))
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)


def test_a_component_that_nobody_observes_is_missed_too(tmp_path: Path) -> None:
    skills = SKILLS.replace("Component battery observable", "Component battery")

    async def script(director: Director) -> None:
        await director.add(PATROL)
        spec = director.system.architecture.components["battery"]
        await director.adapt(Remove("battery"))
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, status.state) == ("energy_saving", ObjectiveState.IN_PROGRESS)
        assert [(each.realization, each.why) for each in status.attempts] == [
            ("normal", "not realisable: the component 'battery' was removed from the stack")
        ]
        await director.wait(2.0)
        assert len(await director.entered()) == 2
        await director.adapt(Add("battery", spec))
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, skills=skills)


def test_a_skill_comes_to_rest_though_a_component_of_its_rest_was_removed(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.adapt(Remove("laser"), Remove("camera"))
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, status.state) == ("", ObjectiveState.IN_ERROR_COMPONENT)
        assert director.states()["controller"] is State.INACTIVE
        await director.cancel("patrol")
        assert (await director.all()).objectives == ()

    perform(tmp_path, script)


def test_a_realization_that_cannot_be_brought_back_rests_and_another_is_chosen(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.adapt(SetParameters("battery", {"stubborn": True}))
        await director.break_part("battery")
        await director.wait(0.2)
        director.mend("battery")
        await director.wait(3.0)
        status = await director.status("patrol")
        assert status.realization == "energy_saving"
        assert (status.state, status.reasons) == (ObjectiveState.IN_PROGRESS, ())

    perform(tmp_path, script)


SPEEDS = """\
modes:
  to_navigate.normal:
    - {change: set_parameters, component: controller, parameters: {speed: 0.5}}
    - {change: transition, component: laser, transition: activate}
  to_navigate.__DEFAULT__:
    - {change: set_parameters, component: controller, parameters: {speed: 0.1}}
    - {change: transition, component: laser, transition: deactivate}
  to_recharge.docking:
    - {change: transition, component: laser, transition: activate}
"""


def test_settings_that_a_rest_took_back_in_part_are_made_again(tmp_path: Path) -> None:
    def speed(director: Director) -> float:
        controller = director.system.running["controller"].runtime.component
        assert isinstance(controller, Part)
        return controller.speed

    async def script(director: Director) -> None:
        await director.add(NAVIGATE, RECHARGE)
        assert speed(director) == 0.5
        await director.cancel("patrol")
        assert speed(director) == 0.1
        await director.add(NAVIGATE)
        assert speed(director) == 0.5

    perform(tmp_path, script, skills=SHARING_LASER, modes=SPEEDS)
