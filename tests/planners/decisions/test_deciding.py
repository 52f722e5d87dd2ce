"""Planners take decisions from files: bandits and forecast the same ones, asked or by themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.adaptation import Add, Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import Transition
from regraft.client import as_json
from regraft.testing import Rig
from tests.planners.decisions.deciding import (
    LOST,
    PACE,
    Bench,
    bench,
    both,
)
from tests.planners.parts import SPEEDS, SmallManager, spec
from tests.planners.test_forecast import Careful


@both
def test_a_planner_reads_the_context_of_a_decision_by_itself(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        proposal = on.propose()
        assert proposal.choice["decision"] == "pace"
        assert proposal.choice["faults"] == ["blind"]
        assert proposal.choice["option"] == {"pace": 0.1}
        assert on.paces == [0.1]


@both
def test_a_dry_decision_touches_nothing(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        assert on.propose(apply=False).choice["outcome"] == "dry"
        assert on.manager.requests == []


@both
def test_a_value_that_is_stale_is_unknown_and_the_fault_then_absent(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        on.rig.advance(5.0)
        proposal = on.propose(apply=False)
        assert proposal.choice["faults"] == []
        assert "fault blind counts as absent: darkness is not known" in proposal.choice["notes"]


def test_the_forecast_takes_what_is_expected_to_be_best_and_explains_it(tmp_path: Path) -> None:
    with bench(tmp_path, "forecast") as on:
        on.dark(0.7)
        chosen = on.propose().choice
        assert chosen["option"] == {"pace": 0.1}
        assert chosen["runners_up"][0]["option"] in ({"pace": 0.18}, {"pace": 0.26})
        estimated = {"before_from": "estimated", "after_from": "estimated"}
        assert chosen["predicted"]["safety"] == {"before": 0.0, "after": 1.0, **estimated}
        assert (chosen["proven"], chosen["solver"]) == (True, "branch_and_bound")
        on.dark(0.2)
        assert on.propose(knobs={"solver": "exhaustive"}).choice["solver"] == "exhaustive"
        assert on.paces == [0.1, 0.26]


def test_without_what_it_needs_to_expect_the_forecast_changes_nothing(tmp_path: Path) -> None:
    with bench(tmp_path, "forecast") as on:
        chosen = on.propose().choice
        assert chosen["outcome"] == "unchanged"
        assert "darkness is not known" in str(chosen["why"])
        told = on.propose(context={"darkness": 0.7}).choice
        assert told["option"] == {"pace": 0.1}


def test_the_bandits_learn_from_the_utility_that_they_measure_themselves(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        first = on.propose()
        on.dark(0.2, seconds=4.0)
        credit = on.propose().choice["credit"]
        assert credit["ticket"] == first.ticket
        assert credit["credited"] is True
        assert credit["utility"] == pytest.approx(0.4)


def test_a_choice_in_force_is_measured_on_where_a_further_one_is_rejected(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        first = on.propose()
        on.manager.fates = [Outcome.REJECTED]
        assert on.propose().choice["outcome"] == "rejected"
        on.dark(0.2, seconds=4.0)
        credit = on.propose().choice["credit"]
        assert (credit["ticket"], credit["utility"]) == (first.ticket, pytest.approx(0.4))


def test_a_choice_that_a_further_one_has_disturbed_is_measured_no_more(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        on.propose()
        on.manager.fates = [Outcome.ROLLED_BACK]
        assert on.propose().choice["outcome"] == "rolled_back"
        on.dark(0.2, seconds=4.0)
        assert "credit" not in on.propose().choice


def test_what_was_measured_of_a_choice_outlives_an_inactive_time(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        first = on.propose()
        on.dark(0.2, seconds=4.0)
        on.rig.transition("bandits", Transition.DEACTIVATE)
        on.rig.transition("bandits", Transition.ACTIVATE)
        credit = on.propose().choice["credit"]
        assert (credit["ticket"], credit["credited"], credit["utility"]) == (first.ticket, True, pytest.approx(0.4))


@pytest.mark.parametrize("before_it", [4.0, 0.5])
def test_what_was_measured_of_a_choice_is_known_to_the_next_run(tmp_path: Path, before_it: float) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        first = on.propose()
        on.dark(0.2, seconds=before_it)
        on.succeed()
        on.dark(0.2, seconds=4.0)
        credit = on.propose().choice["credit"]
        assert (credit["ticket"], credit["credited"], credit["utility"]) == (first.ticket, True, pytest.approx(0.4))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("utility: speed * safety", "utility: speed"),
        ("[0.1, 0.18, 0.26]", "[0.15, 0.2]"),
        ("settle: 1", "settle: 0"),
    ],
)
def test_a_choice_is_measured_on_only_by_a_decision_that_means_the_same(
    tmp_path: Path, before: str, after: str
) -> None:
    text = PACE.partition("faults:")[0]
    with bench(tmp_path, "bandits", text) as on:
        on.dark(0.2)
        on.propose()
        on.dark(0.2, seconds=4.0)
        (tmp_path / "pace.yaml").write_text(text.replace(before, after))
        on.succeed()
        on.dark(0.2)
        assert ("credit" in on.propose().choice) == before.startswith("settle")


def test_a_dry_decision_leaves_the_measuring_of_what_stands(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        first = on.propose()
        assert "credit" not in on.propose(apply=False).choice
        on.dark(0.2, seconds=4.0)
        assert "credit" not in on.propose(apply=False).choice
        credit = on.propose().choice["credit"]
        assert (credit["ticket"], credit["utility"]) == (first.ticket, pytest.approx(0.4))


def test_the_figures_of_what_was_chosen_are_part_of_its_measured_utility(tmp_path: Path) -> None:
    text = PACE.replace(
        "  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.18, 0.26]}",
        """\
  pace:
    alternatives:
      slow: {set: {component: navigator, parameter: max_velocity, value: 0.1}, figures: {calm: 0.25}}
      fast: {set: {component: navigator, parameter: max_velocity, value: 0.26}, figures: {calm: 0}}""",
    )
    text = text.replace("{pace: [0.18, 0.26]}", "{pace: fast}").replace("utility: speed", "utility: total.calm + speed")
    with bench(tmp_path, "bandits", text) as on:
        on.dark(0.95)
        assert on.propose().choice["option"] == {"pace": "slow"}
        on.dark(0.95, seconds=4.0)
        assert on.propose().choice["credit"]["utility"] == pytest.approx(0.25 + 0.5 * 0.05)


OPTIONAL = """\
  pace:
    choose: [0, 1]
    alternatives:
      slow:
        set: {component: navigator, parameter: max_velocity, value: 0.1}
        otherwise: {component: navigator, parameter: max_velocity, value: 0.26}
        figures: {calm: 1}"""


@both
def test_what_is_no_longer_chosen_is_as_it_is_to_be_otherwise(tmp_path: Path, name: str) -> None:
    text = PACE.replace("  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.18, 0.26]}", OPTIONAL)
    text = text.replace(
        "excludes: {pace: [0.18, 0.26]}",
        "prescribes: {pace: slow}\n  lit: {when: darkness < 0.3, excludes: {pace: slow}}",
    )
    with bench(tmp_path, name, text) as on:
        on.dark(0.95)
        assert on.propose().choice["option"] == {"pace": ["slow"]}
        on.dark(0.2, seconds=4.0)
        assert on.propose().choice["option"] == {"pace": []}
        assert on.paces == [0.1, 0.26]
        assert on.propose().choice["outcome"] == "unchanged"


def test_a_credit_that_is_given_counts_and_not_the_measured_one(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        on.dark(0.2)
        first = on.propose()
        on.dark(0.2, seconds=4.0)
        since = first.choice["measure_from"]
        given = {"ticket": first.ticket, "utility": 0.9, "from": since, "to": since + 1.0}
        assert on.propose(credit=given).choice["credit"]["utility"] == 0.9


def test_equal_options_from_a_decision_and_from_a_list_share_what_was_learned(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits") as on:
        first = on.propose(strategy="ucb1")
        listed = {"strategy": "ucb1", "options": [SPEEDS]}
        request = ProposalRequest("drive", inputs=listed)
        second = on.rig.call("planners/bandits/propose", request, Proposal, timeout=60.0)
        assert second.ticket.partition("-")[2] != first.ticket.partition("-")[2]
        third = on.propose(strategy="ucb1")
        assert third.choice["option"] == {"pace": 0.26}


@both
def test_the_journal_has_the_situation_in_which_was_decided(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        on.propose(context={"node": "drive", "qualities": {"safe": {"degree": 0.5}}})
        (request,) = on.manager.requests
        assert request.context == {"node": "drive", "qualities": {"safe": {"degree": 0.5}}, "darkness": 0.95}


@both
def test_a_planner_describes_its_decisions_and_what_of_them_it_cannot_express(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        found = on.rig.call(f"planners/{name}/describe", PlannerQuery(), PlannerDescription, timeout=5.0)
        schema = as_json(found.inputs)
        Draft202012Validator.check_schema(schema)
        validator = Draft202012Validator(schema)
        assert validator.is_valid({"decision": "pace"})
        assert not validator.is_valid({"decision": "peace"})
        assert validator.is_valid({"strategy": found.strategies[0].name, "options": [SPEEDS]})
        assert "cannot express" in str(schema)


def test_the_short_names_of_a_decision_mean_the_robot_that_the_planner_belongs_to(tmp_path: Path) -> None:
    (tmp_path / "pace.yaml").write_text(PACE)
    with Rig() as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        navigators = {name: spec(Careful, name) for name in ("rescuer.navigator", "navigator")}
        manager.architecture = replace(manager.architecture, components=navigators)
        rig.add(ForecastPlanner, "rescuer.forecast", {"decisions": str(tmp_path)}, scope="rescuer")
        request = ProposalRequest("drive", inputs={"decision": "pace"}, context={"darkness": 0.7})
        proposal = rig.call("rescuer/planners/forecast/propose", request, Proposal, timeout=60.0)
        assert proposal.changes == (SetParameters("rescuer.navigator", {"max_velocity": 0.1}),)


SPARE = """\
choices:
  spare:
    alternatives:
      none: {set: {component: helper, present: false}, figures: {help: 0}}
      one:
        figures: {help: 1}
        set: {component: helper, present: {class: 'm:Helper', connect: {image: image}, services: {help: help}}}
objective: {utility: total.help}
"""


def test_a_component_that_a_decision_adds_has_the_topics_and_services_of_the_planners_robot(tmp_path: Path) -> None:
    (tmp_path / "spare.yaml").write_text(SPARE)
    with Rig() as rig:
        rig.add(SmallManager, "adaptation_manager")
        rig.add(ForecastPlanner, "rescuer.forecast", {"decisions": str(tmp_path)}, scope="rescuer")
        request = ProposalRequest("help", inputs={"decision": "spare"}, apply=False)
        (change,) = rig.call("rescuer/planners/forecast/propose", request, Proposal, timeout=60.0).changes
        assert isinstance(change, Add)
        assert change.component == "rescuer.helper"
        assert change.spec.connections == {"image": "rescuer/image"}
        assert change.spec.services == {"help": "rescuer/help"}


NEAR = 'near: "1.0 if darkness > 0.5 else 0.0"'


def test_what_the_forecast_assumes_may_speak_of_weights(tmp_path: Path) -> None:
    weighed = 'near: "1.0 if darkness * caution > 0.5 else 0.0"}\n  weights: {caution: 1.0 + darkness'
    with bench(tmp_path, "forecast", PACE.replace(NEAR, weighed)) as on:
        on.dark(0.3)
        assert on.propose(apply=False).choice["option"] == {"pace": 0.26}
        on.dark(0.4)
        assert on.propose(apply=False).choice["option"] == {"pace": 0.1}


def test_what_the_forecast_assumes_may_speak_of_sums_of_figures(tmp_path: Path) -> None:
    pace = "  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.18, 0.26]}\n"
    light = """\
  lamp: {alternatives: {off: {figures: {light: 0}}, on: {figures: {light: 1}}}}
constraints: [{forbid: {lamp: on}}]
"""
    summed = NEAR.replace("darkness > 0.5", "darkness - total.light > 0.5")
    with bench(tmp_path, "forecast", PACE.replace(pace, pace + light).replace(NEAR, summed)) as on:
        on.dark(0.4)
        assert on.propose(apply=False).choice["option"] == {"pace": 0.26, "lamp": "off"}
        on.dark(0.7)
        assert on.propose(apply=False).choice["option"] == {"pace": 0.1, "lamp": "off"}


@both
def test_what_is_known_without_an_assumption_holds_though_that_is_unknown(tmp_path: Path, name: str) -> None:
    slow = "constraints: [{require: pace < 0.2}]\nqualities:"
    text = PACE.replace("qualities:", slow).replace("utility: speed * safety", 'utility: "0.0 + pace"')
    with bench(tmp_path, name, text) as on:
        chosen = on.propose(apply=False).choice
        assert chosen["option"]["pace"] in (0.1, 0.18)
        assert "darkness is not known" not in chosen["notes"]


ABSENT = """\
choices:
  spare:
    alternatives:
      none: {set: {component: spare, present: false}}
  speed: {component: spare, parameter: speed, values: [1, 2]}
objective: {utility: "0.7", settle: 0}
"""


def test_an_option_of_which_a_component_is_absent_is_credited(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits", ABSENT) as on:
        first = on.propose()
        on.rig.advance(2.0)
        credit = {"ticket": first.ticket, "utility": 0.7, "from": first.choice["measure_from"], "to": 2.0}
        told = on.propose(credit=credit, apply=False).choice["credit"]
        assert told == {"ticket": first.ticket, "credited": True, "utility": 0.7, "why": ""}


def test_an_option_of_which_an_absent_component_was_added_since_is_not_credited(tmp_path: Path) -> None:
    with bench(tmp_path, "bandits", ABSENT) as on:
        first = on.propose()
        on.rig.advance(2.0)
        added = on.manager.architecture.with_component(spec(Careful, "spare"))
        on.manager.architecture = replace(added, revision=added.revision + 1)
        credit = {"ticket": first.ticket, "utility": 0.7, "from": first.choice["measure_from"], "to": 2.0}
        told = on.propose(credit=credit, apply=False).choice["credit"]
        assert told["credited"] is False
        assert told["why"].startswith("somebody else has changed spare.")


@pytest.mark.parametrize(("darkness", "what"), [(0.2, "fault"), (0.7, "requirement")])
def test_faults_and_requirements_are_those_of_the_robot_that_the_planner_belongs_to(
    tmp_path: Path, darkness: float, what: str
) -> None:
    triggers = "triggers: {on_fault: true, on_requirement: [MoveSafely]}\n"
    (tmp_path / "pace.yaml").write_text(LOST + triggers)
    with Rig() as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        navigators = {name: spec(Careful, name) for name in ("rescuer.navigator", "navigator")}
        manager.architecture = replace(manager.architecture, components=navigators)
        rig.add(ForecastPlanner, "rescuer.forecast", {"decisions": str(tmp_path)}, scope="rescuer")
        rig.publish("rescuer/light", LightLevel(0.0, darkness))
        on = Bench(rig, manager, "forecast")
        for scope in ("", "rescuer."):
            assert on.paces == []
            if what == "fault":
                on.fails(f"{scope}wheels")
            else:
                on.requires(False, f"{scope}MoveSafely")
        assert manager.requests[-1].changes == (SetParameters("rescuer.navigator", {"max_velocity": 0.1}),)
