"""Others that change modes, a metacontroller that is swapped, rules that a user adds, and planners' services."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import JOURNAL, ChangeState, EnterMode, SetParameters, Swap
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.stack import StackError, check_with_classes, load
from tests.metacontrol.control.bench import PATROL, SKILLS, perform, write
from tests.metacontrol.control.parts import PLANNER, Director
from tests.support.waiting import PATIENCE

RULE = """\
<?xml version="1.0" encoding="UTF-8"?>
<rdf:RDF xml:base="http://ros/careful" xmlns:owl="http://www.w3.org/2002/07/owl#"
    xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:swrl="http://www.w3.org/2003/11/swrl#"
    xmlns:tomasys="http://metacontrol.org/tomasys#" xmlns:mros="http://ros/mros#">
  <owl:Ontology rdf:about="http://ros/careful"><owl:imports rdf:resource="http://ros/navigation_domain"/></owl:Ontology>
  <swrl:Variable rdf:about="http://ros/careful#d"/>
  <swrl:Imp rdf:about="http://ros/careful#no_normal">
    <swrl:body><swrl:AtomList>
      <rdf:first><swrl:DatavaluedPropertyAtom>
        <swrl:propertyPredicate rdf:resource="http://metacontrol.org/tomasys#c_status"/>
        <swrl:argument1 rdf:resource="http://ros/navigation_domain#camera"/>
        <swrl:argument2>FALSE</swrl:argument2>
      </swrl:DatavaluedPropertyAtom></rdf:first>
      <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/>
    </swrl:AtomList></swrl:body>
    <swrl:head><swrl:AtomList>
      <rdf:first><swrl:DatavaluedPropertyAtom>
        <swrl:propertyPredicate rdf:resource="http://metacontrol.org/tomasys#fd_realisability"/>
        <swrl:argument1 rdf:resource="http://ros/navigation_domain#normal"/>
        <swrl:argument2 rdf:datatype="http://www.w3.org/2001/XMLSchema#boolean">false</swrl:argument2>
      </swrl:DatavaluedPropertyAtom></rdf:first>
      <rdf:rest rdf:resource="http://www.w3.org/1999/02/22-rdf-syntax-ns#nil"/>
    </swrl:AtomList></swrl:head>
  </swrl:Imp>
</rdf:RDF>
"""


def test_a_design_that_others_enter_is_taken_over_and_rest_by_others_is_left(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.adapt(EnterMode("to_navigate.slow"))
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "slow"
        await director.adapt(EnterMode("to_navigate.__DEFAULT__"))
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"

    perform(tmp_path, script)


def test_a_successor_knows_all_and_switches_nothing(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        goal = director.pursue(replace(PATROL, name="goal"))
        await director.add(PATROL)
        await director.break_part("laser")
        await director.set_context("BatteryCharging")
        await director.wait(1.0)
        before, entered = await director.all(), await director.entered()
        report = await director.adapt(Swap(PLANNER))
        assert report.outcome.value == "applied"
        await director.wait(2.0)
        after = await director.all()
        assert [(each.objective, each.realization, each.attempts) for each in after.objectives] == [
            (each.objective, each.realization, each.attempts) for each in before.objectives
        ]
        assert (after.context, after.resting) == ("BatteryCharging", before.resting)
        assert await director.entered() == entered
        goal.cancel()
        await director.wait(1.0)
        assert [each.objective for each in (await director.all()).objectives] == ["patrol"]

    perform(tmp_path, script)


def test_a_context_that_was_published_while_it_was_inactive_counts_as_it_is_repeated(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        assert (await director.all()).context == "Default"
        await director.adapt(ChangeState(PLANNER, Transition.DEACTIVATE))
        director.report_context("OnChargingStation")
        await director.adapt(ChangeState(PLANNER, Transition.ACTIVATE))
        assert (await director.all()).context == "Default"
        director.report_context("OnChargingStation")
        await director.wait(0.2)
        assert (await director.all()).context == "OnChargingStation"

    perform(tmp_path, script)


def test_a_context_that_a_client_sets_stays_until_observers_find_another_also_after_a_swap(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        assert (await director.all()).context == "Default"
        director.report_context("OnChargingStation")
        await director.wait(0.2)
        assert (await director.all()).context == "OnChargingStation"
        await director.set_context("BatteryCharging")
        director.report_context("OnChargingStation")
        await director.wait(0.2)
        assert (await director.all()).context == "BatteryCharging"
        await director.adapt(Swap(PLANNER))
        director.report_context("OnChargingStation")
        await director.wait(0.2)
        assert (await director.all()).context == "BatteryCharging"
        director.report_context("Default")
        await director.wait(0.2)
        assert (await director.all()).context == "Default"

    perform(tmp_path, script)


def test_a_rule_that_a_user_adds_to_the_domain_changes_the_decision(tmp_path: Path) -> None:
    (tmp_path / "careful.owl").write_text(RULE)

    async def script(director: Director) -> None:
        await director.add(PATROL)
        assert (await director.status("patrol")).realization == "normal"
        director.report_component("camera", "FALSE")
        await director.wait(1.0)
        await director.cancel("patrol")
        found = await director.add(PATROL)
        assert found.objectives[0].realization == "slow"
        assert "no_normal" in (await director.explain("patrol")).text

    perform(tmp_path, script, parameters={"knowledge": "careful.owl"})


def test_a_component_that_fell_out_of_its_design_is_brought_back(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.break_part("navigator")
        await director.wait(1.0)
        assert director.states()["navigator"] is State.UNCONFIGURED
        director.mend("navigator")
        await director.wait(2.0)
        assert director.states()["navigator"] is State.ACTIVE

    perform(tmp_path, script)


async def _propose(director: Director, *, apply: bool) -> Proposal:
    request = ProposalRequest("patrol", apply=apply, inputs={"skill": "to_navigate", "requirements": {"safety": 0.5}})
    return await director.kit.call(f"planners/{PLANNER}/propose", request, Proposal, timeout=30.0)


def test_it_is_asked_for_proposals_as_other_planners_are(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        described = await director.kit.call(f"planners/{PLANNER}/describe", PlannerQuery(), PlannerDescription)
        assert "requirements" in described.inputs["properties"]
        dry = await _propose(director, apply=False)
        assert (dry.choice["option"], dry.choice["outcome"]) == ("performance", "dry")
        assert dry.changes == (EnterMode("to_navigate.performance"),)
        assert (await director.all()).objectives == ()
        done = await _propose(director, apply=True)
        assert (done.choice["option"], done.choice["outcome"]) == ("performance", "applied")
        assert done.report is not None
        again = await _propose(director, apply=True)
        assert (again.choice["outcome"], again.changes) == ("unchanged", ())

    perform(tmp_path, script)


def test_a_proposed_objective_has_the_name_that_its_inputs_give(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        inputs = {"skill": "to_navigate", "name": "patrol"}
        request = ProposalRequest("rounds", apply=True, inputs=inputs)
        done = await director.kit.call(f"planners/{PLANNER}/propose", request, Proposal, timeout=PATIENCE)
        assert (done.task, done.choice["objective"]) == ("rounds", "patrol")
        assert [each.objective for each in (await director.all()).objectives] == ["patrol"]

    perform(tmp_path, script)


def test_its_journal_has_the_decision_as_context_and_a_reason(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        page = await director.kit.call(JOURNAL, JournalRequest(limit=10), JournalPage)
        (line,) = [each for each in page.entries if each.request.actor == PLANNER]
        assert line.request.context["context"] == "Default"
        (decision,) = line.request.context["decisions"]
        assert [each["design"].rpartition("#")[2] for each in decision["designs"] if each["selected"]] == ["normal"]
        assert line.request.reason.startswith("patrol: normal, as normal has the utility")

    perform(tmp_path, script)


def test_a_component_that_two_skills_use_rests_only_when_both_have_ended(tmp_path: Path) -> None:
    skills = (
        SKILLS
        + """\
Skill to_watch { quality attributes [safety] }
Realization by_camera of to_watch {
  Component camera active, Component dock active
  Quality [safety: 0.9]; context: Default
};
"""
    )

    async def script(director: Director) -> None:
        director.report_component("laser", "FALSE")
        await director.wait(0.2)
        await director.add(PATROL, replace(PATROL, skill="to_watch", name="watch", requirements={}))
        assert director.states()["camera"] is State.ACTIVE
        director.report_component("laser", "RECOVERED")
        await director.wait(1.0)
        assert (await director.status("patrol")).realization == "normal"
        assert director.states()["camera"] is State.ACTIVE
        await director.cancel("watch")
        assert (director.states()["camera"], director.states()["dock"]) == (State.INACTIVE, State.INACTIVE)
        assert director.states()["laser"] is State.ACTIVE

    perform(tmp_path, script, skills=skills)


def test_values_that_others_change_within_a_design_are_left_alone(tmp_path: Path) -> None:
    async def script(director: Director) -> None:
        await director.add(PATROL)
        await director.adapt(SetParameters("controller", {"speed": 0.33}))
        await director.wait(2.0)
        assert director.system.view("controller").parameters["speed"] == 0.33

    perform(tmp_path, script)


def test_a_stack_without_an_adaptation_manager_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path)
    text = file.read_text()
    start, end = text.index("  adaptation_manager:"), text.index("modes: modes.yaml")
    file.write_text(text[:start] + text[end:])
    with pytest.raises(StackError, match=r"metacontrol.*needs an adaptation manager"):
        check_with_classes(load(file))
