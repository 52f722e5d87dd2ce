"""Objectives: what is refused, what a client may ask for, and several at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.management.objectives import (
    BINDING_ERROR,
    CurvePoint,
    Objective,
    ObjectiveState,
    ObjectiveStatus,
    Progress,
    ProgressReport,
)
from tests.metacontrol.control.bench import PATROL, SKILLS, perform
from tests.metacontrol.control.parts import PLANNER, Director

POSE = {"position": {"x": 1.0, "y": 2.0, "z": 0.0}}
WRONG: list[tuple[Objective, str, str]] = [
    (replace(PATROL, skill="to_navigat"), "skill", "did you mean 'to_navigate'"),
    (replace(PATROL, name="a/b"), "name", "without '/'"),
    (replace(PATROL, requirements={"safty": 0.5}), "requirements.safty", "did you mean 'safety'"),
    (replace(PATROL, requirements={"comfort": 0.5}), "requirements.comfort", "does not list it"),
    (replace(PATROL, requirements={"safety": 1.5}), "requirements.safety", "must be from 0 to 1"),
    (replace(PATROL, weights={"safety": -1.0}), "", "must be a number from 0 to"),
    (replace(PATROL, weights={"sped": 1.0}), "weights.sped", "there is no quality 'sped'"),
    (replace(PATROL, realization="nrmal"), "realization", "did you mean 'normal'"),
    (replace(PATROL, realization="docking"), "", "solves 'to_recharge'"),
    (replace(PATROL, inputs={"gaol": POSE}), "inputs.gaol", "did you mean 'goal'"),
    (replace(PATROL, inputs={"goal": 3.0}), "inputs.goal", "of the type PoseStamped"),
]


def test_wrong_objectives_are_refused_with_the_field_and_what_would_be_right(tmp_path: Path) -> None:
    skills = SKILLS + "Quality comfort { better: higher, range: 0..1 }\nSkill to_sit { quality attributes [comfort] }\n"

    async def script(director: Director) -> None:
        for wrong, field, why in WRONG:
            with pytest.raises(CallFailed) as refused:
                await director.add(Objective("to_navigate", "right"), wrong)
            assert refused.value.field == f"objectives.1{'.' if field else ''}{field}", wrong
            assert why in refused.value.why, (wrong, refused.value.why)
        assert (await director.all()).objectives == ()
        await director.add(replace(PATROL, inputs={"goal": POSE}))

    perform(tmp_path, script, skills=skills)


def test_the_realization_to_begin_with_is_honoured_and_left_when_it_fails(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = await director.add(replace(PATROL, realization="energy_saving"))
        assert found.objectives[0].realization == "energy_saving"
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "energy_saving"
        await director.break_part("laser")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "degraded"

    perform(tmp_path, script)


def test_an_objective_has_weights_of_its_own(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        found = await director.add(replace(PATROL, weights={"safety": 0.0, "energy": 1.0}))
        assert found.objectives[0].realization == "slow"

    perform(tmp_path, script)


def test_an_objective_has_curves_of_its_own(tmp_path: Path) -> None:
    flat = (CurvePoint(0.0, 0.0), CurvePoint(0.2, 1.0))

    async def script(director: Director) -> None:
        energy = (CurvePoint(0.3, 1.0), CurvePoint(0.5, 0.0))
        found = await director.add(replace(PATROL, curves={"performance": flat, "energy": energy}))
        assert found.objectives[0].realization == "slow"
        with pytest.raises(CallFailed) as refused:
            await director.add(replace(PATROL, name="other", curves={"energy": flat[:1]}))
        assert refused.value.field == "objectives.0.curves.energy"

    perform(tmp_path, script)


def test_the_objective_of_higher_priority_is_decided_first_and_the_other_is_told_who_holds_what(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(replace(PATROL, name="fast", requirements={}, priority=1.0))
        careful = Objective("to_navigate", "careful", {"safety": 0.65}, priority=2.0)
        found = {each.objective: each for each in (await director.add(careful)).objectives}
        assert found["careful"].realization == "normal"
        fast = await director.status("fast")
        assert fast.realization == "normal"
        explained = await director.explain("fast")
        assert "which careful holds" in explained.text

    perform(tmp_path, script)


def test_an_objective_that_excludes_one_of_higher_priority_has_no_realization(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        thrifty = Objective("to_navigate", "thrifty", {"energy": 0.3}, priority=2.0)
        quick = Objective("to_navigate", "quick", {"performance": 0.9})
        first, second = (await director.add(quick, thrifty)).objectives
        assert (first.objective, first.realization) == ("quick", "")
        assert "which thrifty holds" in first.reasons[0]
        assert (second.objective, second.realization) == ("thrifty", "slow")
        await director.cancel("thrifty")
        await director.wait(1.0)
        assert (await director.status("quick")).realization == "performance"

    perform(tmp_path, script)


def test_the_context_selects_among_realizations_and_an_unknown_one_is_refused(tmp_path: Path) -> None:
    station = (
        SKILLS
        + """\
Realization waiting of to_navigate {
  Component navigator active, Component controller active.SLOW
  Quality [safety: 0.9, performance: 0.05, energy: 0.05]; context: OnChargingStation
};
"""
    )

    async def script(director: Director) -> None:
        await director.add(PATROL)
        before = await director.set_context("OnChargingStation")
        assert (before.before, before.context) == ("Default", "OnChargingStation")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "waiting"
        with pytest.raises(CallFailed) as refused:
            await director.set_context("OnChargingSation")
        assert (refused.value.code, refused.value.field) == (RefusalCode.NOT_FOUND, "context")
        assert "did you mean 'OnChargingStation'" in refused.value.why
        await director.set_context("BatteryCharging")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script, skills=station)


def test_an_objective_that_always_improves_needs_a_margin(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        for name, improves in (("still", False), ("better", True)):
            await director.add(Objective("to_navigate", name, {}, always_improve=improves, realization="normal"))
            await director.wait(1.0)
            expected = "performance" if improves else "normal"
            assert (await director.status(name)).realization == expected, name
            await director.cancel(name)
        await director.add(Objective("to_navigate", "near", {}, always_improve=True, realization="normal"))
        await director.wait(1.0)

    perform(tmp_path, script)


def test_a_small_gain_is_not_worth_a_change(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(Objective("to_navigate", "near", {}, always_improve=True, realization="normal"))
        await director.wait(2.0)
        assert (await director.status("near")).realization == "normal"

    perform(tmp_path, script, parameters={"margin": 0.3})


def test_a_goal_hears_of_the_error_and_of_the_change(tmp_path: Path) -> None:
    heard: list[tuple[str, str]] = []

    async def script(director: Director) -> None:
        goal = director.kit.goal(
            f"planners/{PLANNER}/objective",
            PATROL,
            ObjectiveStatus,
            ObjectiveStatus,
            on_feedback=lambda each: heard.append((each.realization, each.state.value)),
        )
        await director.wait(1.0)
        await director.break_part("laser")
        await director.wait(1.0)
        assert goal.feedback is not None

    perform(tmp_path, script)
    assert ("", "UNGROUNDED") in heard
    error = heard.index(("normal", "IN_ERROR_COMPONENT"))
    assert heard.index(("normal", "IN_PROGRESS")) < error < heard.index(("degraded", "IN_PROGRESS"))


async def _report(director: Director, **given: Any) -> ObjectiveStatus:
    request = ProgressReport("patrol", **given)
    return await director.kit.call(f"planners/{PLANNER}/objectives/report", request, ObjectiveStatus)


def test_the_results_of_a_skill_classify_its_progress_and_its_end_ends_the_objective(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        goal = director.pursue(PATROL)
        await director.wait(1.0)
        assert (await _report(director, text="IN_PROGRESS")).progress is Progress.INPROGRESS
        with pytest.raises(CallFailed) as refused:
            await _report(director, text="okay")
        assert refused.value.field == "text"
        assert (await _report(director, text="OK")).progress is Progress.SUCCESS
        result = await goal.outcome()
        assert result.progress is Progress.SUCCESS
        await director.wait(1.0)
        assert (await director.all()).objectives == ()
        await director.add(PATROL)
        assert (await _report(director, text="InternalError")).progress is Progress.ERROR

    perform(tmp_path, script)


def test_what_reports_an_error_of_its_own_is_left(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.wait(0.2)
        director._diagnose(BINDING_ERROR, {}, "patrol", Level.ERROR, None)
        await director.wait(1.0)
        status = await director.status("patrol")
        assert (status.realization, status.state) == ("slow", ObjectiveState.IN_PROGRESS)

    perform(tmp_path, script)


def test_an_explanation_says_of_each_realization_what_spoke_for_or_against_it(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.break_part("laser")
        await director.wait(1.0)
        text = (await director.explain("patrol")).text
        for part in (
            "patrol: degraded (IN_PROGRESS)",
            "normal: not selected, utility 0.76",
            "against: not realisable",
            "energy is estimated 0.7, must be <= 0.5",
            "s ago: normal: not realisable: laser has failed (rule required-component)",
        ):
            assert part in text, text
        with pytest.raises(CallFailed) as refused:
            await director.explain("ptrol")
        assert refused.value.code is RefusalCode.NOT_FOUND

    perform(tmp_path, script)
