"""ReBeT's evaluations: equal seeds give equal rows, and what was published comes out again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from regraft.evaluation.finding import find_study
from regraft.evaluation.publishing.verifying import sampled, verify
from regraft.evaluation.results.table import read_table
from regraft.evaluation.runs.attempts import AttemptLog, Outcome
from tests.evaluation.test_campaign import contents, run
from tests.support.frog import Load
from tests.support.paths import ROOT

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(4 * 3600)]


RESULTS = sorted((ROOT / "docs" / "results").glob("*.csv"))


@pytest.mark.parametrize("file", RESULTS, ids=lambda file: file.name)
def test_five_rows_of_every_published_table_come_out_again(file: Path, tmp_path: Path) -> None:
    differing = verify(sampled(read_table(file), 5, seed=len(read_table(file).rows)), tmp_path, print)
    elsewhere = {each.made_with for each in differing}
    if differing and all(made_with.startswith("processor ") for made_with in elsewhere):
        pytest.skip(f"this machine rounds differently from {' and '.join(sorted(elsewhere))}")
    assert differing == []


def digests(out: Path) -> dict[str, str]:
    """Return the digest of each run of a campaign, by the run's name."""
    paths = out.glob("runs/*/*/run.json")
    return {
        path.parent.relative_to(out).as_posix(): json.loads(path.read_text())["closing"]["digest"] for path in paths
    }


def test_equal_seeds_give_equal_rows_in_every_configuration(tmp_path: Path) -> None:
    options = ("--definitions", "corrected", "--configurations", "*.blocked", "--runs", "1", "--for", "60")
    for name in ("first", "second"):
        code, said = run(tmp_path / name, *options, study="frog-architecture")
        assert code == 0, said
    blocked = [
        each for each in find_study("frog-architecture").configurations["corrected"] if each.scenario == "blocked"
    ]
    assert len(contents(tmp_path / "first")) == 2 * len(blocked)
    assert contents(tmp_path / "first") == contents(tmp_path / "second")


@pytest.mark.alone
def test_a_campaign_beside_twelve_busy_loops_fails_in_nothing_and_is_the_one_made_alone(tmp_path: Path) -> None:
    """None of its runs had to be made again, and each has the digest of the same run alone."""
    arms = ("--configurations", "internal.blocked,planned.blocked", "--runs", "2", "--for", "60")
    alone, loaded = tmp_path / "alone", tmp_path / "loaded"
    code, said = run(alone, "--definitions", "corrected", *arms, study="frog-architecture")
    assert code == 0, said
    with Load(12, apart=True):
        code, said = run(loaded, "--definitions", "corrected", *arms, "--parallel", "2", study="frog-architecture")
    print((loaded / "attempts.csv").read_text())
    assert code == 0, said
    assert [each.outcome for each in AttemptLog(loaded).read()] == [Outcome.KEPT] * 4
    assert digests(loaded) == digests(alone)
    assert contents(loaded) == contents(alone)


def test_each_violation_of_the_battery_requirement_is_answered_in_nine_rooms_of_ten(tmp_path: Path) -> None:
    code, said = run(tmp_path, study="frog-tasks")
    assert code == 0, said
    report = (tmp_path / "report.md").read_text()
    print(report)
    assert "(kept: wanted in 90%)" in report


def test_the_published_comparisons_have_their_direction_with_all_equal_seeds(tmp_path: Path) -> None:
    code, said = run(tmp_path, "--definitions", "published", "--runs", "10", study="frog-architecture")
    assert code == 0, said
    report = (tmp_path / "report.md").read_text()
    print(report)
    for name in ("U_vis", "U_det"):
        for key in ("internal", "external"):
            start = f"| {name} | {key} > baseline |"
            line = next(line for line in report.splitlines() if line.startswith(start))
            assert line.endswith("| 10 of 10 |"), line
