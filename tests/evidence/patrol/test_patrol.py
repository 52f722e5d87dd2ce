"""Ten seeds of ten minutes under metacontrol, each with contingencies of its own; and one of them twice."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from tests.support.commands import in_home, run
from tests.support.paths import PATROL
from tests.support.running import entered, ran

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(7200)]

SECONDS = 600.0
RUNS = 10


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, float]]:
    """Run every seed once, and return the measures of each."""
    home = tmp_path_factory.mktemp("patrol")
    out = home / "runs"
    study = ("evaluate", "patrol-managers", "--configurations", "metacontrol", "--runs", str(RUNS))
    options = ("--for", f"{SECONDS:g}", "--parallel", "2", "--out", str(out))
    ended = run(*study, *options, environment=in_home(home), within=7000.0)
    assert ended.returncode == 0, ended.stderr
    with (out / "results.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    measures = ("places", "contacts", "lowest charge", "worst error at a place (m)", "adaptations")
    shown = [{name: float(row[name] or "nan") for name in measures} for row in found]
    for number, row in enumerate(shown, start=1):
        print(f"run {number}: {row}")
    return shown


def test_nothing_is_touched_in_nine_of_ten(rows: list[dict[str, float]]) -> None:
    assert len(rows) == RUNS
    assert sum(row["contacts"] == 0.0 for row in rows) >= 9


def test_the_battery_is_never_empty(rows: list[dict[str, float]]) -> None:
    assert all(row["lowest charge"] > 0.0 for row in rows)


def test_the_robot_knows_at_each_place_where_it_is(rows: list[dict[str, float]]) -> None:
    assert all(row["worst error at a place (m)"] <= 0.3 for row in rows)


def test_every_robot_adapts_and_gets_to_places(rows: list[dict[str, float]]) -> None:
    assert all(row["adaptations"] >= 4.0 and row["places"] >= 4.0 for row in rows)


def test_equal_runs_are_equal_with_their_decisions(tmp_path: Path) -> None:
    failures = "[{at: 60, device: lidar, failure: frozen}, {at: 120, device: lidar, failure: none}]"
    runs = [ran(PATROL, tmp_path / str(number), SECONDS, f"world.failures={failures}") for number in range(2)]
    assert len({each["digest"] for each in runs}) == 1
    decided = [entered(tmp_path / str(number)) for number in range(2)]
    assert decided[0] == decided[1]
    assert "to_navigate.degraded" in [mode for _, mode in decided[0]]
