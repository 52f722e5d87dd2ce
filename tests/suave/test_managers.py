"""SUAVE's other managers, none and one that chooses at random: what each does in a run, and in the study."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Outcome
from regraft.stack import load
from regraft.stacks.suave.studies.reactions import STUDY
from tests.support.paths import SUAVE
from tests.support.running import modes, ran, reports

pytestmark = pytest.mark.slow

SHORT = ("detect_pipeline.area=4", "battery_monitor.discharge_time=1e9")
SEARCH, INSPECTION = "f_generate_search_path.", "f_follow_pipeline."


def test_without_a_manager_the_tasks_begin_and_no_mode_is_entered(tmp_path: Path) -> None:
    ran(SUAVE / "none.yaml", tmp_path, 45.0, *SHORT)
    found = [each for each in reports(tmp_path) if each.request.changes]
    assert [(each.request.actor, each.outcome) for each in found] == [
        ("search", Outcome.APPLIED),
        ("inspection", Outcome.APPLIED),
    ]


def test_a_manager_that_chooses_at_random_does_so_for_the_present_task_in_equal_runs_alike(tmp_path: Path) -> None:
    short = (*SHORT, "search_manager.period=3", "inspection_manager.period=3")
    runs = [ran(SUAVE / "random.yaml", tmp_path / str(number), 45.0, *short) for number in range(2)]
    assert runs[0]["digest"] == runs[1]["digest"]
    home = tmp_path / "0"
    assert {each.outcome for each in reports(home)} == {Outcome.APPLIED}
    searching, inspecting = modes(home, "search_manager"), modes(home, "inspection_manager")
    assert len(set(searching)) > 1
    assert all(mode.startswith(SEARCH) for mode in searching)
    assert all(mode.startswith(INSPECTION) for mode in inspecting)
    actors = [each.request.actor for each in reports(home)]
    begins = actors.index("inspection")
    assert "search_manager" not in actors[begins:]
    assert actors[begins + 1 :] == ["inspection_manager"] * len(inspecting)


def test_nobody_decides_by_knowledge_where_there_is_another_manager() -> None:
    for file in ("none.yaml", "random.yaml"):
        assert "metacontrol" not in load(SUAVE / file).architecture.components


def test_the_study_has_every_manager_in_both_scenarios() -> None:
    keys = {each.key for each in STUDY.configurations["corrected"]}
    assert keys == {
        f"{arm}.{scenario}" for arm in ("metacontrol", "random", "none") for scenario in ("published", "drawn")
    }
