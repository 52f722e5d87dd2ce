"""Reasons are data until somebody reads them, and then are those of the time of the decision."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.reasoning import considering
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import Against
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import plan
from tests.metacontrol.owl import ENERGY, SAFETY, design, individual, iri, published_designs, write
from tests.metacontrol.reasoning.cycle import FAILED, Cycle, objective


def test_planning_puts_no_reason_into_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def causes(reason: object) -> str:
        raise AssertionError(reason)

    cycle = Cycle(write(tmp_path, published_designs()), objective(bounds={SAFETY: 0.5}))
    cycle.set_components(laser_resender=FAILED, camera=FAILED)
    monkeypatch.setattr(considering, "causes", causes)
    cycle.run()
    decision = cycle.decision()
    assert {each.kind for one in decision.assessments for each in one.against} == {Against.UNREALISABLE}
    with pytest.raises(AssertionError):
        _ = decision.why


def test_reasons_are_those_of_the_decision_and_not_of_later(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, published_designs()), objective(bounds={SAFETY: 0.5, ENERGY: 0.5}))
    cycle.run()
    cycle.measure(SAFETY, 0.4)
    cycle.run()
    decision = cycle.decision()
    before = decision.as_data()
    cycle.now += 10_000
    cycle.resting.forget(iri("drive"))
    cycle.set_components(battery=FAILED)
    cycle.run()
    assert decision.as_data() == before
    assert cycle.decision().as_data() != before


def test_equal_arguments_give_equal_plans_after_any_others(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, published_designs()), objective(bounds={SAFETY: 0.5}))
    model, situation, analysis = cycle.analyser.model, cycle.situation, cycle.analysis
    first = plan(model, situation, analysis, cycle.resting, 0.0).as_data()
    for number in range(300):
        other = objective(bounds={SAFETY: number / 300})
        cycle.situation = type(situation)((other,))
        cycle.run()
    assert plan(model, situation, analysis, cycle.resting, 0.0).as_data() == first


def test_the_reason_of_a_requirement_without_a_design_is_short_at_any_depth(tmp_path: Path) -> None:
    functions = [individual(f"f{number}", "tomasys:Function") for number in range(12)]
    chain = [individual(f"o{number}", "tomasys:Objective", tomasys__typeF=f">f{number + 1}") for number in range(11)]
    designs = [
        design(f"d{number}_{way}", f"f{number}", {}, mros__fd_requiresO=[f">o{number}"])
        for number in range(11)
        for way in range(2)
    ]
    cycle = Cycle(write(tmp_path, *functions, *chain, *designs), objective(function="f0"))
    cycle.run()
    decision = cycle.decision()
    assert decision.design is None
    assert decision.why.startswith("d0_0: it requires f1, which has no design: d1_0: it requires f2")
    assert len(decision.why) < 1000
    assert "more useful" not in decision.why
