"""The patrol's files: they fit each other, and only studies read the truth."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills, read_skills
from regraft.bus_schema.model.lifecycle import State
from regraft.evaluation.results.table import read_table
from regraft.evaluation.runs.run_directory import Plan, prepare
from regraft.evaluation.study import Study, variant
from regraft.stack import load
from regraft.stacks.patrol.studies import managers, qualities
from tests.support.paths import PATROL, ROOT

pytestmark = pytest.mark.slow

STACKS = sorted(PATROL.glob("*.yaml"))
SKILLS = PATROL / "patrol.skills"
RESULTS = ROOT / "docs" / "results" / "patrol-qualities.csv"
TRUTH = ("ground_truth", "truth/")
PARTS = ("amcl", "planner_server", "bt_navigator", "controller_server", "laser_resender")


@pytest.mark.parametrize("file", STACKS, ids=lambda file: file.stem)
def test_every_stack_is_right_and_nobody_but_the_recorder_reads_the_truth(file: Path) -> None:
    architecture = load(file).architecture
    topics = [topic for topic in architecture.topics if topic.startswith(TRUTH)]
    readers = {component for topic in topics for component, _ in architecture.readers(topic)}
    assert readers
    assert all(architecture.components[name].cls.endswith("Recorder") for name in readers)


@pytest.mark.parametrize("study", [managers.STUDY, qualities.STUDY], ids=lambda study: study.name)
def test_every_configuration_of_the_studies_makes_a_stack_that_is_right(tmp_path: Path, study: Study) -> None:
    for each in study.configurations["measured"]:
        changes = (study.additions, each.changes(7))
        plan = Plan(study.name, "measured", each, 1, 7, study.seconds, study.stack, changes)
        architecture = load(prepare(plan, tmp_path / each.key)).architecture
        assert ("metacontrol" in architecture.components) == (each.name == "metacontrol")


def test_the_generated_files_are_those_of_the_skills() -> None:
    checked = checked_skills(SKILLS, load(PATROL / "stack.yaml").architecture)
    assert [each for each in checked.diagnostics if each.severity.value == "error"] == []
    files = {file.name: file.read_text() for file in (PATROL / "metacontrol").iterdir()}
    assert files == generated(checked.skills)


@pytest.mark.parametrize("file", STACKS, ids=lambda file: file.stem)
def test_the_robot_may_rest_in_every_stack(tmp_path: Path, file: Path) -> None:
    resting = tmp_path / "resting.yaml"
    states = "".join(f"  {part}: {{state: inactive}}\n" for part in PARTS)
    resting.write_text(f"include: ['{file}']\ncomponents:\n{states}")
    assert load(resting).architecture.components["amcl"].state is State.INACTIVE


def test_the_skills_have_the_qualities_that_were_measured() -> None:
    rows = read_table(RESULTS).rows
    measured = {
        each.name: each.estimates for each in read_skills(SKILLS).realizations if each.name in qualities.PUBLISHED
    }
    assert set(measured) == set(qualities.PUBLISHED)
    for name, estimates in measured.items():
        for estimate in estimates:
            mean = fmean(row.measures[estimate.quality] for row in rows if row.arm == name)
            assert estimate.value == pytest.approx(mean, abs=0.0055), (name, estimate.quality)


def test_a_manager_of_the_study_is_that_of_its_stack_file() -> None:
    assert variant(PATROL / "rules.yaml")["components"]["metacontrol"] is None
    assert variant(PATROL / "rules.yaml")["rules"]["blind"]["mode"] == "to_navigate.degraded"
    assert variant(PATROL / "random.yaml")["components"]["docking"] == {"state": "active"}
    assert "include" not in variant(PATROL / "tree.yaml")


def test_both_studies_have_a_configuration_for_each_manager_and_each_realization() -> None:
    assert [each.name for each in managers.STUDY.configurations["measured"]] == [
        "metacontrol",
        "rules",
        "tree",
        "random",
        "none",
    ]
    assert {each.name for each in qualities.STUDY.configurations["measured"]} == set(qualities.PUBLISHED)
