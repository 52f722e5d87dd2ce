"""Tables of runs that were made in parts become one, or are refused with what does not fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.evaluation.results.joining import joined
from regraft.evaluation.results.table import BadTable, ResultRow, ResultTable, read_table, table_text
from tests.evaluation.publishing.test_table import row
from tests.support.commands import run


def write(file: Path, *rows: ResultRow) -> Path:
    file.write_text(table_text(ResultTable(("reached",), rows)))
    return file


def test_parts_of_a_campaign_become_one_table_by_scenario_and_arm(tmp_path: Path) -> None:
    one = write(tmp_path / "one.csv", row(1), row(1, "slow"))
    other = write(tmp_path / "other.csv", row(2), row(3))
    out = tmp_path / "all.csv"
    ended = run("evaluate", "join", str(one), str(other), "--out", str(out))
    assert ended.returncode == 0, ended
    assert [(each.arm, each.seed) for each in read_table(out).rows] == [
        ("fast", 1),
        ("fast", 2),
        ("fast", 3),
        ("slow", 1),
    ]


def test_parts_with_and_without_pictures_become_one_table(tmp_path: Path) -> None:
    tables = [
        ResultTable(("reached",), (replace(row(seed, arm), renderer=renderer),), f"{arm}.csv")
        for seed, (arm, renderer) in enumerate((("lidar", ""), ("camera", "rays"), ("sonar", "")))
    ]
    assert {each.arm: each.renderer for each in joined(tables).rows} == {"lidar": "", "camera": "rays", "sonar": ""}
    other = ResultTable(("reached",), (replace(row(9), renderer="egl"),), "other.csv")
    with pytest.raises(BadTable, match=r"renderer: is 'egl', in camera\.csv 'rays'"):
        joined([*tables, other])


@pytest.mark.parametrize(
    ("second", "told"),
    [
        (row(1), "fast with seed 1 is in"),
        (replace(row(2), code="other"), "code: is 'other'"),
        (replace(row(2), seconds=8.0), "seconds: is 8.0"),
        (replace(row(2), study="great"), "study: is 'great'"),
        (replace(row(2), renderer="egl"), "renderer: is 'egl'"),
    ],
)
def test_parts_that_do_not_fit_are_refused_and_nothing_is_written(tmp_path: Path, second: ResultRow, told: str) -> None:
    out = tmp_path / "all.csv"
    parts = str(write(tmp_path / "a.csv", row(1))), str(write(tmp_path / "b.csv", second))
    ended = run("evaluate", "join", *parts, "--out", str(out))
    assert ended.returncode == 2
    assert told in ended.stderr
    assert not out.exists()
