"""The shipped rules find errors in bindings, components and required objectives, and each has an explanation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import load
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.knowledge.view import model_of
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import GRAVITY, Analyser
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation, facts_of
from tests.metacontrol.owl import LASER, NAVIGATE, SAFETY, design, individual, iri, rule, write
from tests.metacontrol.reasoning.cycle import FAILED, Cycle, objective

BINDINGS = (
    design("scan", NAVIGATE, {}, tomasys__roles=">role"),
    design("wander", NAVIGATE, {}),
    individual("role", "tomasys:Role", tomasys__roleDef=">spec"),
    individual("spec", "tomasys:ComponentSpecification", tomasys__typeC=">class"),
    individual("class", "tomasys:ComponentClass", tomasys__cc_unique=True),
    individual(LASER, tomasys__typeC=">class"),
    individual("o", "tomasys:Objective", tomasys__typeF=f">{NAVIGATE}"),
    individual(
        "fg",
        "tomasys:FunctionGrounding",
        tomasys__typeFD=">scan",
        tomasys__solvesO=">o",
        tomasys__hasBindings=">binding",
    ),
    individual("binding", "tomasys:Binding", tomasys__binding_role=">role", tomasys__binding_component=f">{LASER}"),
)


def test_a_component_that_fails_in_a_binding_is_followed_to_grounding_objective_and_designs(tmp_path: Path) -> None:
    analyser = Analyser(load([write(tmp_path, *BINDINGS)]))
    model = analyser.model
    begin = Situation(tuple(model.objectives.values()), tuple(model.groundings.values()), dict(model.components))
    assert analyser.analyse(begin).objectives[iri("o")].status is Status.IN_PROGRESS
    found = analyser.analyse(replace(begin, components={iri(LASER): FAILED}))
    assert found.objectives[iri("o")].status is Status.IN_ERROR_COMPONENT
    assert found.unrealisable == {iri("scan")}
    (reason,) = found.why_in_error(iri("o"))
    assert [line.split("(")[0].strip() for line in reason.lines()] == [
        "o_status", "fg_status", "hasBindings", "b_status", "binding_component", "c_status", "solvesO",
    ]  # fmt: skip
    why = found.why_unrealisable(iri("scan"))
    assert why is not None
    assert why.rule in {"S5", "S11"}


def test_a_class_with_one_component_is_unavailable_without_any_binding(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, *BINDINGS[:6]), objective())
    cycle.set_components(laser_resender=FAILED)
    assert cycle.design() == "wander"
    assert cycle.analysis.unrealisable == {iri("scan")}


def test_of_several_errors_the_gravest_is_the_status_and_all_are_listed(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, design("d", NAVIGATE, {SAFETY: 0.9}, (LASER,))), objective(bounds={SAFETY: 0.5}))
    cycle.run()
    cycle.measure(SAFETY, 0.1)
    cycle.report_error(Status.IN_ERROR_FR)
    cycle.set_components(laser_resender=FAILED)
    state = cycle.analyse().objectives[iri("drive")]
    assert state.status is Status.IN_ERROR_COMPONENT
    assert state.errors == GRAVITY
    assert cycle.analysis.conflicts == (), "a status may have several values"
    assert len(cycle.analysis.why_in_error(iri("drive"))) == 3


def test_conclusions_that_contradict_are_reported(tmp_path: Path) -> None:
    hopeful = rule("hopeful", ["tomasys:FunctionDesign ?x"], ["tomasys:fd_realisability ?x true"])
    cycle = Cycle(write(tmp_path, design("d", NAVIGATE, {}, (LASER,)), hopeful), objective())
    assert cycle.analyse().conflicts == ()
    cycle.set_components(laser_resender=FAILED)
    assert cycle.analyse().conflicts == (
        "d: fd_realisability has one value at most: fd_realisability(d, true) by hopeful;"
        " fd_realisability(d, false) by required-component",
    )


def test_a_rule_of_the_application_decides_with(tmp_path: Path) -> None:
    tired = rule("tired", ["tomasys:fg_status ?x ?v", "tomasys:typeFD ?x ?y"], ["tomasys:fd_realisability ?y false"])
    parts = (design("one", NAVIGATE, {}), design("two", NAVIGATE, {}))
    for added, expected in (((), frozenset()), ((tired,), {iri("one")})):
        cycle = Cycle(write(tmp_path, *parts, *added), objective())
        cycle.run()
        cycle.report_error(Status.IN_ERROR_FR)
        assert cycle.analyse().unrealisable == expected


@pytest.mark.parametrize("failed", [False, True])
def test_the_analysis_has_all_conclusions_of_all_rules(tmp_path: Path, failed: bool) -> None:
    """It leaves out axioms from which no rule concludes anything, and keeps what follows from the files."""
    knowledge = load([write(tmp_path, *BINDINGS[:6])])
    analyser = Analyser(knowledge)
    situation = replace(
        Cycle(tmp_path / "app.owl", objective()).situation, components={iri(LASER): FAILED} if failed else {}
    )
    whole = knowledge.conclude(facts_of(model_of(knowledge), situation))
    found = analyser.analyse(situation).conclusions
    assert found.all() <= whole.all()
    assert {fact for fact in whole.all() if len(fact) == 3} == {fact for fact in found.all() if len(fact) == 3}
