"""FROG explores a room, with real processes."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.evaluation.runs.search_run import run_search
from tests.missions.robot import STACKS

pytestmark = pytest.mark.slow


def test_a_robot_that_explores_maps_the_room_and_knows_its_place_without_touching_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    judged = run_search(STACKS / "explore.yaml", 2, tmp_path, at_least=20.0, at_most=20.0).judgement
    assert judged.mission == "running"
    assert judged.distance > 2.0
    assert judged.contacts == 0
    assert min(judged.occupied_iou or 0.0, judged.free_iou or 0.0) >= 0.9
    assert judged.worst_pose_error <= 0.10


@pytest.mark.evidence
def test_a_room_is_explored_and_mapped_and_the_robot_goes_home_charged_without_touching_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    run = run_search(STACKS / "explore.yaml", 2, tmp_path, at_least=10.0, at_most=240.0)
    judged = run.judgement
    assert judged.mission == "succeeded"
    assert judged.contacts == 0
    assert min(judged.occupied_iou or 0.0, judged.free_iou or 0.0) >= 0.9
    assert judged.worst_pose_error <= 0.10
    assert judged.charges["exploring"] >= 2
    assert judged.lowest_charge > 0.5
