"""Absurd objectives, and names that several things share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft import CallFailed, RefusalCode
from regraft.adaptation_manager.planners.metacontrol.control.groundings import Grounded
from regraft.adaptation_manager.planners.metacontrol.control.keeping import FILE
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.skills.generators.system_modes import system_modes
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet
from regraft.bus_schema.messages.management.objectives import Objective, ObjectiveState
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import EnterMode, SetParameters
from tests.metacontrol.control import bench
from tests.metacontrol.control.bench import PATROL, SKILLS, BreakableReasoner, perform
from tests.metacontrol.control.parts import PLANNER, Break, Director
from tests.support.waiting import PATIENCE

HUGE = {"safety": 1e308, "performance": 1e308, "energy": 1e308}
SHARED = (
    SKILLS
    + """\
Skill to_watch { quality attributes [safety] }
Realization normal of to_watch {
  Component dock active
  Quality [safety: 0.9]; context: Default
};
"""
)
LIKE_OTHERS = SHARED.replace("Realization normal of to_watch", "Realization NAME of to_watch").replace(
    "Component dock active\n", "Component laser active\n"
)
OF_ROBOT = SKILLS.replace("Component laser", "Component robot/laser")


def have_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the laser belong to a robot: its component ``robot.laser`` is ``robot/laser`` in skills."""
    monkeypatch.setattr(bench, "PARTS", ("robot.laser", *bench.PARTS[1:]))
    topics = "topics:\n  robot/scan: {{type: modes/Sample}}\n"
    monkeypatch.setattr(bench, "STACK", bench.STACK.replace("topics:\n", topics))


@pytest.mark.parametrize("name", ["  ", "a\nb", "a\0b", "\x1b[2J", "a\u202eb"])
def test_a_name_that_cannot_be_shown_is_refused(tmp_path: Path, name: str) -> None:
    async def script(director: Director) -> None:
        with pytest.raises(CallFailed) as refused:
            await director.add(replace(PATROL, name=name))
        assert (refused.value.code, refused.value.field) == (RefusalCode.INVALID, "objectives.0.name")

    perform(tmp_path, script)


def test_weights_whose_sum_is_no_number_are_refused(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        with pytest.raises(CallFailed) as refused:
            await director.add(replace(PATROL, weights=HUGE))
        assert "must be a number from 0 to 1e+09" in refused.value.why

    perform(tmp_path, script)


def test_unknown_names_of_any_length_are_refused_briefly(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        for name in ("s" * 300_000, "\x1b" * 1000):
            with pytest.raises(CallFailed) as refused:
                await director.add(replace(PATROL, requirements={name: 0.5}))
            assert len(str(refused.value)) < 10_000

    perform(tmp_path, script)


def test_sixty_four_objectives_are_provided_and_one_more_is_refused(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        given = [replace(PATROL, name="ü" * 190 + str(number)) for number in range(64)]
        found = await director.add(*given)
        assert [each.realization for each in found.objectives] == ["normal"] * 64
        with pytest.raises(CallFailed) as refused:
            await director.add(PATROL)
        assert refused.value.code is RefusalCode.QUEUE_FULL

    perform(tmp_path, script)


def test_the_knowledge_base_is_saved_with_names_of_any_characters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reasoner = BreakableReasoner(monkeypatch)
    error = ValueError("no conclusion")

    async def script(director: Director) -> None:
        await director.add(replace(PATROL, name="grüße <&\"' {x} | ^ ` \\ %"))
        reasoner.error = error
        await director.wait(1.0)
        events = await director.told("metacontrol.reasoner_failed")
        assert "could not be saved" not in events[0]

    perform(tmp_path, script)
    assert load([tmp_path / FILE]).facts


def test_a_realization_to_begin_with_has_the_name_of_its_file_though_skills_share_it(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = await director.add(
            replace(PATROL, realization="normal"), Objective("to_watch", "watch", realization="normal")
        )
        assert [each.mode for each in found.objectives] == ["to_navigate.normal", "to_watch.normal"]

    perform(tmp_path, script, skills=SHARED)


@pytest.mark.parametrize("name", ["laser", "to_watch"])
@pytest.mark.parametrize("one_system", ["", "robot"])
def test_a_realization_may_be_named_like_a_skill_or_an_observable_component(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, one_system: str
) -> None:
    monkeypatch.setattr(bench, "system_modes", lambda skills: system_modes(skills, one_system))

    async def script(director: Director) -> None:
        found = await director.add(Objective("to_watch", "watch", realization=name))
        assert [each.mode for each in found.objectives] == [f"{one_system or 'to_watch'}.{name}"]

    perform(tmp_path, script, skills=LIKE_OTHERS.replace("NAME", name))


def test_a_realization_without_a_mode_does_not_take_that_of_another_skill_with_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without_normal(skills: SkillSet) -> str:
        text = system_modes(skills)
        return text.replace("      normal:", "      renamed:", 1)

    monkeypatch.setattr(bench, "system_modes", without_normal)

    async def script(director: Director) -> None:
        await director.add(PATROL, Objective("to_watch", "watch"))
        assert (await director.status("patrol")).mode != "to_watch.normal"
        assert (await director.status("watch")).mode == "to_watch.normal"

    perform(tmp_path, script, skills=SHARED)


def test_groundings_of_different_objectives_and_designs_never_share_a_name() -> None:
    assert Grounded("a_b", "http://x#c", 0.0).name != Grounded("a", "http://x#b_c", 0.0).name


def test_a_mode_of_another_skill_in_the_same_system_is_not_taken_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "system_modes", lambda skills: system_modes(skills, "robot"))

    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.adapt(EnterMode("robot.docking"))
        await director.wait(1.0)
        assert (await director.status("patrol")).mode == "robot.normal"

    perform(tmp_path, script)


def test_the_failure_of_a_component_with_a_slash_in_its_name_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    have_robot(monkeypatch)

    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.kit.call("robot/parts/laser/break", Break(), Break, timeout=PATIENCE)
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "degraded"
        director.mend("robot.laser")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, skills=OF_ROBOT)


@pytest.mark.parametrize("name", ["robot.laser", "robot/laser"])
def test_an_observer_names_a_component_as_the_stack_or_the_skills_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    have_robot(monkeypatch)

    async def script(director: Director) -> None:
        await director.add(PATROL)
        director.report_component(name, "FALSE")
        await director.wait(1.0)
        found = await director.status("patrol")
        assert (found.realization, found.attempts[0].realization) == ("degraded", "normal")

    perform(tmp_path, script, skills=OF_ROBOT)


def test_the_rest_that_a_component_with_a_slash_in_its_name_is_to_blame_for_ends_with_its_recovery(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    have_robot(monkeypatch)

    async def script(director: Director) -> None:
        found = (await director.add(PATROL)).objectives[0]
        assert (found.realization, found.state) == ("degraded", ObjectiveState.IN_PROGRESS)
        director.report_component("robot/laser", "FALSE")
        await director.wait(1.0)
        await director.adapt(SetParameters("robot.laser", {"stubborn": False}))
        director.report_component("robot/laser", "RECOVERED")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    given = {"robot.laser": "stubborn: true"}
    perform(tmp_path, script, skills=OF_ROBOT, parts=given)


def test_a_proposal_for_a_present_objective_of_other_content_is_refused_and_changes_nothing(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        for apply in (False, True):
            request = ProposalRequest(
                "patrol", apply=apply, inputs={"skill": "to_navigate", "requirements": {"safety": 0.9}}
            )
            with pytest.raises(CallFailed) as refused:
                await director.kit.call(f"planners/{PLANNER}/propose", request, Proposal, timeout=30.0)
            assert refused.value.code is RefusalCode.CONFLICT
        assert (await director.status("patrol")).requirements == PATROL.requirements

    perform(tmp_path, script)
