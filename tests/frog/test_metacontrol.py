"""FROG under metacontrol: its mission asks for a skill, which stays provided when a camera fails."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationReport, EnterMode
from regraft.services.observers.evidence import topics_of
from regraft.stack import load
from tests.support.frog import run_frog
from tests.support.paths import FROG

pytestmark = pytest.mark.slow

STACK = FROG / "metacontrol.yaml"
SKILLS = FROG / "metacontrol.skills"
TICKS_A_SECOND = 20
BLACK = "camera.failures=[{at: 8, failure: black}]"


def entered(home: Path) -> list[tuple[str, float]]:
    """Return the modes that the metacontroller has entered in the latest run, and when (s); the first has no tick."""
    with sqlite3.connect(home / "frog" / "journal.sqlite") as journal:
        rows = journal.execute("SELECT report FROM adaptations WHERE actor = 'metacontrol' ORDER BY number").fetchall()
    reports = [codec.decode(row[0], AdaptationReport) for row in rows]
    return [
        (change.mode, (report.tick or 0) / TICKS_A_SECOND)
        for report in reports
        for change in report.request.changes
        if isinstance(change, EnterMode)
    ]


def test_the_generated_files_are_those_of_the_skills() -> None:
    checked = checked_skills(SKILLS, load(STACK).architecture)
    assert checked.diagnostics == ()
    files = {file.name: file.read_text() for file in (FROG / "metacontrol").iterdir()}
    assert files == generated(checked.skills)


def test_both_cameras_answer_for_the_topic_that_they_take_turns_to_write() -> None:
    topics = topics_of(("camera", "corner_camera", "navigator"), load(STACK).architecture, {})
    assert topics == {"camera": {"camera/image"}, "corner_camera": {"camera/image"}, "navigator": {"velocity"}}


def test_a_black_camera_is_left_for_the_one_in_the_corner_and_equal_runs_are_equal(tmp_path: Path) -> None:
    runs = [run_frog(tmp_path / str(n), 40.0, "--speed", "max", "--set", BLACK, stack=STACK) for n in range(2)]
    for run in runs:
        assert (run.code, run.summary["problems"], run.summary["reproducible"]) == (0, [], True), run.errors
    assert len({run.summary["digest"] for run in runs}) == 1
    modes = entered(tmp_path / "0")
    assert [mode for mode, _ in modes] == ["to_inspect.swift", "to_inspect.from_the_corner", "to_inspect.swift"]
    assert 8.0 < modes[1][1] < 12.0
    assert runs[0].summary["pictures"]["corner_camera"] > 0
