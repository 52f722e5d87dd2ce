"""FROG's studies are found by their names, and every stack that they run holds together."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from regraft.bus_schema.model.consistency import violations
from regraft.evaluation.campaign import Wanted
from regraft.evaluation.finding import find_study, studies
from regraft.evaluation.rows import Rows
from regraft.evaluation.runs.run_directory import AS_RUN, Plan, prepare
from regraft.evaluation.study import Changes, Results
from regraft.services.bt_executor.checking import check, known_nodes
from regraft.stack import load
from regraft.stacks.frog.studies.arms.scenarios import SCENARIOS
from regraft.stacks.frog.studies.exploring_measures import LIMIT, is_kept
from regraft.stacks.frog.studies.exploring_measures import violations as battery_violations

STUDIES = ("frog-architecture", "frog-tasks")
PLANS = [
    Wanted(study, definitions, tuple(known), 1, 1, study.seconds).plans()[index]
    for study in map(find_study, STUDIES)
    for definitions, known in study.configurations.items()
    for index in range(len(known))
]


def test_studies_are_found_by_their_names() -> None:
    assert {*STUDIES} <= set(studies())


@pytest.mark.parametrize("plan", PLANS, ids=[f"{plan.definitions} {plan.name}" for plan in PLANS])
def test_the_stack_of_each_configuration_is_consistent_and_its_mission_can_be_loaded(
    plan: Plan, tmp_path: Path
) -> None:
    file = prepare(plan, tmp_path / "run")
    assert file.name == AS_RUN
    stack = load(file)
    assert violations(stack.architecture) == ()
    executor = stack.architecture.components["bt_executor"].parameters
    assert "rows" in stack.architecture.components
    assert check(Path(str(executor["mission"])), known_nodes(str(executor["nodes"]).split())).errors == ()


def test_a_configuration_differs_from_the_others_by_what_it_says_only() -> None:
    documents = {plan.name: yaml.safe_dump(plan.document()) for plan in PLANS if plan.definitions == "corrected"}
    assert len(set(documents.values())) == len(documents)


@pytest.mark.parametrize("name", STUDIES)
def test_a_report_of_nothing_says_so(name: str) -> None:
    study = find_study(name)
    for definitions in study.configurations:
        report = study.report(Results(definitions, (), (), 10, "regraft evaluate"))
        assert "**10 runs are still to be made**" in report.markdown
        assert "No run is finished." in report.markdown


def battery(*charges: float, charging: tuple[int, ...] = (), **others: list[str]) -> Rows:
    """Return rows of a battery, in some of which the robot goes charging, with other columns."""
    tasks = ["charging" if index in charging else "exploring" for index in range(len(charges))]
    satisfied = [str(int(charge >= LIMIT)) for charge in charges]
    times = [str(n) for n in range(len(charges))]
    return Rows({"time": times, "charge": [str(c) for c in charges], "task": tasks, "satisfied": satisfied, **others})


def test_a_violation_is_answered_by_charging_back_above_the_limit() -> None:
    twice = battery(0.95, 0.89, 0.85, 0.91, 0.95, 0.89, 0.92, charging=(2, 3, 5, 6))
    assert [each.is_answered for each in battery_violations(twice)] == [True, True]
    assert is_kept(twice)
    assert not is_kept(battery(0.95, 0.89, 0.91, charging=(1,)))
    unanswered = battery(0.89, 0.91, 0.89, 0.91, 0.88, charging=(0, 2, 4))
    assert [each.is_answered for each in battery_violations(unanswered)] == [True, True, False]
    assert not is_kept(unanswered)


def test_with_one_seed_the_runs_differ_by_the_light_at_their_beginning_only() -> None:
    study = find_study("frog-architecture")
    first, second = Wanted(study, "published", (study.configurations["published"][0],), 2, 7, 300.0, True).plans()
    assert first.seed == second.seed == 7
    phases = [plan.document()["components"]["lighting"]["parameters"].pop("phase") for plan in (first, second)]
    assert phases[0] != phases[1]
    assert all(abs(phase - 51.8) < 5.0 for phase in phases)
    documents = [plan.document() for plan in (first, second)]
    for document in documents:
        document["components"]["lighting"]["parameters"].pop("phase")
    assert documents[0] == documents[1]


def test_further_runs_have_the_next_seeds_the_same_for_all_configurations() -> None:
    study = find_study("frog-architecture")
    plans = Wanted(study, "corrected", tuple(study.configurations["corrected"]), 3, 5, 300.0).plans()
    assert {plan.seed for plan in plans if plan.number == 2} == {6}
    assert len({plan.name for plan in plans}) == len(plans) == 3 * len(study.configurations["corrected"])


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_all_arms_of_a_scenario_have_the_same_circumstances(scenario: str) -> None:
    """For each seed: the world, the light, and when the corner camera is blocked."""
    study = find_study("frog-architecture")
    known = [each for each in study.configurations["corrected"] if each.scenario == scenario]
    assert len(known) > 5
    found = {seed: {circumstances(configuration.changes(seed)) for configuration in known} for seed in (1001, 1002)}
    assert all(len(each) == 1 for each in found.values())
    assert found[1001] != found[1002]


def circumstances(changes: Changes) -> str:
    """Return what no arm decides on."""
    parts = changes["components"]
    return str((changes.get("world"), parts.get("lighting"), parts.get("corner_camera")))


@pytest.mark.parametrize("name", STUDIES)
def test_every_definition_of_a_study_has_columns_trade_offs_included(name: str) -> None:
    study = find_study(name)
    assert set(study.measures) == set(study.configurations)
    for columns in study.measures.values():
        assert "contacts" in columns
        wanted = {"drive energy (J)", "legs", "hits", "pictures", "near", "MoveSafely", "adaptations applied"}
        others = {"energy drawn (J)", "distance (m)", "charges"}
        names = {column.removesuffix(", corrected") for column in columns}
        assert names >= (wanted if name == "frog-architecture" else others)


def test_the_figures_of_exploring_are_sums_and_last_values() -> None:
    names = {"power": 10.0, "charger_power": 2.0, "charges": 1, "frontiers_left": 3, "contacts": 0}
    columns = {name: [str(value)] * 3 for name, value in names.items()}
    places = {"x": ["0", "3", "3"], "y": ["0", "4", "5"]}
    found = battery(0.95, 0.89, 0.92, charging=(1,), **columns, **places)
    figures = {name: measure(found) for name, measure in find_study("frog-tasks").measures["corrected"].items()}
    assert (figures["energy drawn (J)"], figures["energy offered (J)"], figures["distance (m)"]) == (30.0, 6.0, 6.0)
    assert (figures["violations"], figures["violations answered"], figures["lowest charge"]) == (1.0, 1.0, 0.89)
    assert (figures["charges"], figures["frontiers left"], figures["contacts"]) == (1.0, 3.0, 0.0)
    assert figures["charging"] == pytest.approx(1 / 3)
