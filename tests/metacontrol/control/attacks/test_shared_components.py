"""Skills that share components, and components that are removed from the stack while objectives need them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from regraft.bus_schema.messages.management.objectives import ObjectiveState
from regraft.bus_schema.model.adaptation import Add, EnterMode, Remove, SetParameters
from regraft.bus_schema.model.lifecycle import State
from tests.metacontrol.control.bench import PATROL, SKILLS, perform
from tests.metacontrol.control.parts import Director

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
