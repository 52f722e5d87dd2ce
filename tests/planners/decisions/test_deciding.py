"""Planners take decisions from files: bandits and forecast the same ones, asked or by themselves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from regraft import CallFailed
from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.adaptation_manager.planners.decisions.deciding import DecidingPlanner
from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.messages.management.system import SystemFault, SystemFaultKind, SystemFaults, SystemQualities
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.client import as_json
from regraft.component.parameters import ParameterError
from regraft.testing import Rig
from tests.planners.parts import SPEEDS, SmallManager, spec
from tests.planners.test_forecast import Careful

PLANNERS: dict[str, type[DecidingPlanner]] = {"bandits": BanditPlanner, "forecast": ForecastPlanner}
PACE = """\
context:
  darkness: {topic: light, field: darkness, stale_after: 2}
  safely: {requirement: MoveSafely}
choices:
  pace: {component: navigator, parameter: max_velocity, values: [0.1, 0.18, 0.26]}
qualities:
  speed: {measured: "0.5", estimated: navigator.speed}
  safety: {measured: "1.0 - darkness", estimated: navigator.safety}
objective:
  utility: speed * safety
  assume: {near: "1.0 if darkness > 0.5 else 0.0"}
  settle: 1
faults:
  blind:
    when: darkness > 0.9
    excludes: {pace: [0.18, 0.26]}
"""


class Bench:
    def __init__(self, rig: Rig, manager: SmallManager, name: str) -> None:
        self.rig, self.manager, self.name = rig, manager, name

    def dark(self, darkness: float, seconds: float = 0.1) -> None:
        """Let it be so dark for a while."""
        until = self.rig.clock.now() / 1e9 + seconds
        while self.rig.clock.now() / 1e9 < until:
            self.rig.publish("light", LightLevel(self.rig.clock.now() / 1e9, darkness))
            self.rig.advance(0.1)

    def requires(self, satisfied: bool | None, requirement: str = "MoveSafely") -> None:
        """Let the system say whether it is safe."""
        now = self.rig.clock.now() / 1e9
        quality = Quality(now, requirement, "Safety", satisfied=satisfied)
        self.rig.publish("system/qualities", SystemQualities(now, (quality,)))

    def fails(self, *components: str) -> None:
        """Let the system say that these have failed, and no others."""
        now = self.rig.clock.now() / 1e9
        present = tuple(SystemFault(now, name, 1, SystemFaultKind.DIED) for name in components)
        self.rig.publish("system/faults", SystemFaults(now, present, present))

    def propose(self, apply: bool = True, context: dict[str, Any] | None = None, **inputs: Any) -> Proposal:
        request = ProposalRequest("drive", "pace", "tree", apply, {"decision": "pace", **inputs}, context or {})
        return self.rig.call(f"planners/{self.name}/propose", request, Proposal, timeout=60.0)

    @property
    def reasons(self) -> list[str]:
        return [request.reason for request in self.manager.requests]

    @property
    def paces(self) -> list[Any]:
        changes = [change for request in self.manager.requests for change in request.changes]
        return [change.parameters["max_velocity"] for change in changes if isinstance(change, SetParameters)]


@contextmanager
def bench(folder: Path, name: str, text: str = PACE) -> Iterator[Bench]:
    (folder / "pace.yaml").write_text(text)
    with Rig() as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        manager.architecture = manager.architecture.with_component(spec(Careful, "navigator"))
        rig.add(PLANNERS[name], name, {"decisions": str(folder)})
        yield Bench(rig, manager, name)


both = pytest.mark.parametrize("name", PLANNERS)


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
        assert chosen["predicted"]["safety"] == {"before": 0.0, "after": 1.0}
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


# --- triggers ---


@both
def test_it_decides_by_itself_at_fixed_intervals(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {every: 2}\n") as on:
        on.dark(0.95, seconds=1.5)
        assert on.manager.requests == []
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("every 2 s; ")


@both
def test_it_decides_when_a_fault_comes_and_when_it_is_gone(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.dark(0.2, seconds=1.0)
        assert on.manager.requests == []
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("fault blind has come; ")
        if name == "forecast":
            on.dark(0.2, seconds=1.0)
            assert on.paces == [0.1, 0.26]
            assert on.reasons[1].startswith("fault blind is gone; ")


@both
def test_it_decides_when_a_requirement_turns(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_requirement: [MoveSafely]}\n") as on:
        on.requires(True)
        on.dark(0.95, seconds=1.0)
        assert on.manager.requests == []
        on.requires(False)
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("requirement MoveSafely is not met; ")


@both
def test_a_decision_that_cannot_be_taken_is_told_once_and_the_planner_lives_on(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {every: 1}\n") as on:
        on.manager.fates = ["blind"]
        on.dark(0.2, seconds=5.0)
        told = [event for event in on.rig.events if event.kind == "planner.undecided"]
        assert len(told) == 1
        assert "the journal cannot be read" in told[0].text
        on.manager.fates = []
        on.dark(0.95, seconds=2.0)
        assert on.paces == [0.1]


LOST = PACE.replace("  safely:", "  stuck: {fault: wheels}\n  safely:").replace("darkness > 0.9", "stuck")


@both
def test_a_fault_holds_from_the_failure_of_its_component_to_its_recovery(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, LOST) as on:
        on.dark(0.2)
        assert "fault blind counts as absent: stuck is not known" in on.propose(apply=False).choice["notes"]
        for failed, faults in (((), []), (("wheels", "camera"), ["blind"]), (("camera",), [])):
            on.fails(*failed)
            assert on.propose(apply=False).choice["faults"] == faults


@both
def test_it_decides_at_once_when_a_component_fails(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, LOST + "triggers: {on_fault: true}\n") as on:
        on.dark(0.2, seconds=1.0)
        on.fails("camera")
        assert on.manager.requests == []
        on.fails("camera", "wheels")
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("fault blind has come; ")


@both
def test_a_planner_that_starts_amid_a_fault_decides(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]


@both
@pytest.mark.parametrize("unknown", ["another", "unsatisfiable"])
def test_a_requirement_that_is_not_known_is_no_reason_to_decide(tmp_path: Path, name: str, unknown: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_requirement: [MoveSafely]}\n") as on:
        on.dark(0.95)
        on.requires(None) if unknown == "unsatisfiable" else on.requires(False, "another")
        on.rig.advance(1.0)
        assert on.manager.requests == []


@both
def test_a_planner_reads_of_the_system_only_what_its_decisions_speak_of(tmp_path: Path, name: str) -> None:
    def topics(text: str) -> set[str]:
        (tmp_path / "pace.yaml").write_text(text)
        ports = PLANNERS[name].ports_for({"decisions": str(tmp_path)})
        return {port.topic for port in ports if port.topic and port.topic.startswith("system/")}

    plain = PACE.replace("  safely: {requirement: MoveSafely}\n", "")
    assert topics(plain) == set()
    assert topics(PACE) == {"system/qualities"}
    assert topics(LOST) == {"system/qualities", "system/faults"}


# --- one robot among several ---


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


# --- what goes wrong ---


@both
@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ({"decision": "pacee"}, "inputs.decision: there is no decision 'pacee'; did you mean 'pace'?"),
        ({"options": [SPEEDS]}, "inputs.options: is given next to 'decision', which has its own"),
        ({"strategy": "ucb77"}, "inputs.strategy: there is no strategy 'ucb77'"),
        ({"sort": 1}, "sort"),
    ],
)
def test_inputs_that_do_not_fit_a_decision_are_refused_by_name(
    tmp_path: Path, name: str, inputs: dict[str, Any], told: str
) -> None:
    with bench(tmp_path, name) as on:
        with pytest.raises(CallFailed) as failure:
            on.propose(**inputs)
        assert told in failure.value.why
        assert on.manager.requests == []


@both
def test_a_decision_about_what_is_not_there_is_refused_and_nothing_is_done(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE.replace("component: navigator", "component: navigatr")) as on:
        with pytest.raises(CallFailed, match="choice pace: there is no component 'navigatr'; did you mean 'navigator'"):
            on.propose()
        assert on.manager.requests == []


def test_the_forecast_refuses_a_utility_that_it_cannot_express(tmp_path: Path) -> None:
    text = PACE.replace('speed: {measured: "0.5", estimated: navigator.speed}', 'speed: {measured: "0.5"}')
    told = r"pace: qualities\.speed is only measured, so it cannot be expected"
    with bench(tmp_path, "forecast", text) as on, pytest.raises(CallFailed, match=told):
        on.propose(context={"darkness": 0.2})


def test_what_the_forecast_cannot_search_in_its_way_is_refused_with_another(tmp_path: Path) -> None:
    told = r"inputs\.knobs: there is no solver 'cpsat'; did you mean 'cp_sat'"
    with bench(tmp_path, "forecast") as on, pytest.raises(CallFailed, match=told):
        on.propose(knobs={"solver": "cpsat"})


@both
def test_a_decision_that_is_rolled_back_is_told(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        on.manager.fates = [Outcome.ROLLED_BACK]
        proposal = on.propose()
        assert proposal.choice["outcome"] == "rolled_back"
        assert proposal.ticket == ""


@both
def test_a_file_with_mistakes_keeps_the_planner_from_starting_by_line_and_field(tmp_path: Path, name: str) -> None:
    (tmp_path / "pace.yaml").write_text(PACE.replace("topic: light", "topik: light"))
    with pytest.raises(ParameterError, match=r"pace\.yaml:2: context\.darkness"):
        list(PLANNERS[name].ports_for({"decisions": str(tmp_path)}))


@pytest.mark.parametrize(
    ("file", "told"),
    [("pa-ce.yaml", "'pa-ce' must be letters, digits and '_'"), ("pace.txt", "holds no decision: must have at least")],
)
def test_a_folder_without_decisions_or_with_a_name_that_cannot_be_is_refused(
    tmp_path: Path, file: str, told: str
) -> None:
    (tmp_path / file).write_text(PACE)
    with pytest.raises(ParameterError, match=told):
        list(ForecastPlanner.ports_for({"decisions": str(tmp_path)}))


@both
def test_an_architecture_that_changed_meanwhile_is_decided_on_anew(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        on.manager.fates = ["overtaken"]
        on.manager.architecture = replace(on.manager.architecture, revision=7)
        assert on.propose().choice["outcome"] == "applied"
        assert len(on.manager.requests) == 2
