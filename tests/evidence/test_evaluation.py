"""ReBeT's evaluations: equal seeds give equal rows, and what was published comes out again."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.evaluation.test_campaign import contents, run

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(4 * 3600)]


def test_equal_seeds_give_equal_rows_in_every_configuration(tmp_path: Path) -> None:
    options = ("--definitions", "corrected", "--configurations", "*.blocked", "--runs", "1", "--for", "60")
    for name in ("first", "second"):
        code, said = run(tmp_path / name, *options, study="frog-architecture")
        assert code == 0, said
    assert len(contents(tmp_path / "first")) == 2 * 9
    assert contents(tmp_path / "first") == contents(tmp_path / "second")


def test_each_violation_of_the_battery_requirement_is_answered_in_nine_rooms_of_ten(tmp_path: Path) -> None:
    code, said = run(tmp_path, study="frog-tasks")
    assert code == 0, said
    report = (tmp_path / "report.md").read_text()
    print(report)
    assert "(kept: wanted in 90%)" in report


def test_the_published_tests_come_out_again(tmp_path: Path) -> None:
    code, said = run(tmp_path, "--definitions", "published", "--runs", "10", study="frog-architecture")
    assert code == 0, said
    report = (tmp_path / "report.md").read_text()
    print(report)
    for name in ("U_vis", "U_det"):
        for key in ("internal", "external"):
            start = f"| {name} | {key} > baseline |"
            line = next(line for line in report.splitlines() if line.startswith(start))
            assert "| yes |" in line, line
