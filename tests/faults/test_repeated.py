"""Runs with faults on their schedule, decided upon as they are seen, are the same run each time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.faults.stacks import write
from tests.support.commands import in_home, run


def _run(folder: Path, *options: str) -> dict[str, Any]:
    folder.mkdir()
    stack = write(folder)
    faults = [word for fault in options for word in ("--fault", fault)]
    done = run("up", str(stack), "--headless", "--json", "--for", "8", *faults, environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _agree(folder: Path, *faults: str, times: int = 3) -> dict[str, Any]:
    """Run it some times; return what all runs say alike, and what the first one counts."""
    runs = [_run(folder / str(number), *faults) for number in range(times)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    return runs[0]


def test_without_faults_there_are_none(tmp_path: Path) -> None:
    found = _run(tmp_path / "run")
    assert found["reproducible"]
    assert not any(what.startswith("driver.") for what in found["visits"])


def test_a_kill_and_what_is_decided_by_it_are_the_same_in_every_run(tmp_path: Path) -> None:
    found = _agree(tmp_path, "2 driver kill", times=5)
    assert found["visits"]["driver.died"] == found["visits"]["driver.recovered"] == 1
    assert found["visits"]["spare"] > 0


@pytest.mark.parametrize(
    ("kind", "seen"), [("stop", "driver.hung"), ("hang", "driver.hung"), ("exception", "driver.raised")]
)
def test_every_kind_of_fault_is_the_same_in_every_run(tmp_path: Path, kind: str, seen: str) -> None:
    assert _agree(tmp_path, f"2 driver {kind}", times=2)["visits"][seen] == 1


def test_a_slow_component_makes_the_run_slower_and_no_other(tmp_path: Path) -> None:
    slow, fast = _run(tmp_path / "slow", "2 driver slow 0.01"), _run(tmp_path / "fast")
    assert slow["digest"] == fast["digest"]


def test_many_faults_in_a_row_are_the_same_in_every_run(tmp_path: Path) -> None:
    faults = ("1 driver kill", "2.5 summary exception", "3 decider kill", "4 adaptation_manager kill", "5 driver stop")
    assert _agree(tmp_path, *faults)["restarts"] == 4


def test_a_component_that_dies_too_often_stays_away_in_every_run(tmp_path: Path) -> None:
    faults = [f"{second} driver kill" for second in (1, 2, 3, 4, 5, 6)]
    assert _agree(tmp_path, *faults, times=2)["visits"]["driver.quarantined"] == 1
