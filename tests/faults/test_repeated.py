"""Runs with faults on their schedule, decided upon as they are seen, are the same run each time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.faults.stacks import STACK, write
from tests.support.commands import in_home, run

pytestmark = pytest.mark.slow


def _run(folder: Path, *options: str, seconds: float = 5.0, text: str = STACK) -> dict[str, Any]:
    folder.mkdir()
    stack = write(folder, text)
    faults = [word for fault in options for word in ("--fault", fault)]
    words = ("--headless", "--json", "--for", f"{seconds:g}", *faults)
    done = run("up", str(stack), *words, environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(params=[2, pytest.param(10, marks=pytest.mark.evidence)])
def times(request: pytest.FixtureRequest) -> int:
    """Return how many runs are compared."""
    count: int = request.param
    return count


def _agree(folder: Path, times: int, *faults: str, seconds: float = 5.0) -> dict[str, Any]:
    """Run it so many times; return what all runs say alike, and what the first one counts."""
    runs = [_run(folder / str(number), *faults, seconds=seconds) for number in range(times)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    return runs[0]


def test_a_kill_and_what_is_decided_by_it_are_the_same_in_every_run(tmp_path: Path, times: int) -> None:
    found = _agree(tmp_path, times, "2 driver kill")
    assert found["visits"]["driver.died"] == found["visits"]["driver.recovered"] == 1
    assert found["visits"]["spare"] > 0


def test_every_other_kind_of_fault_is_the_same_in_every_run(tmp_path: Path, times: int) -> None:
    visits = _agree(tmp_path, times, "1 driver stop", "2.5 driver hang", "4 driver exception")["visits"]
    assert (visits["driver.hung"], visits["driver.raised"]) == (2, 1)


def test_a_slow_component_makes_the_run_slower_and_no_other(tmp_path: Path) -> None:
    slow, fast = _run(tmp_path / "slow", "2 driver slow 0.01"), _run(tmp_path / "fast")
    assert fast["reproducible"]
    assert slow["digest"] == fast["digest"]
    assert not any(what.startswith("driver.") for what in fast["visits"]), "without faults there are none"


def test_many_faults_in_a_row_are_the_same_in_every_run(tmp_path: Path, times: int) -> None:
    faults = ("1 driver kill", "2.5 summary exception", "3 decider kill", "4 adaptation_manager kill", "5 driver stop")
    assert _agree(tmp_path, times, *faults, seconds=6.0)["restarts"] == 4


def test_a_component_that_dies_too_often_stays_away_in_every_run(tmp_path: Path, times: int) -> None:
    faults = [f"{second} driver kill" for second in (1, 2, 3, 4, 5, 6)]
    assert _agree(tmp_path, times, *faults, seconds=7.0)["visits"]["driver.quarantined"] == 1


def test_a_component_that_may_be_silent_for_long_is_back_after_it_hung(tmp_path: Path) -> None:
    text = STACK.replace("parts:World", "parts:ImpatientWorld")
    text = text.replace("parts:Driver'}", "parts:Driver', limits: {handler_timeout: 4}}", 1)
    found = _run(tmp_path / "run", "1 driver hang", "2 driver stop", text=text)
    assert (found["reproducible"], found["restarts"]) == (True, 2), found
    assert found["visits"]["driver.recovered"] == 2
