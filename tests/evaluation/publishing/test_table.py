"""A table of results is what was measured, or it is refused with its line."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.evaluation.results.table import BadTable, ResultRow, ResultTable, read_table, table_text

TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), max_size=8)
VALUE = st.just(math.nan) | st.floats(-1e6, 1e6).map(lambda value: float(f"{value:.6g}"))


def row(seed: int = 1, arm: str = "fast", value: float = 0.5) -> ResultRow:
    about = ("reporting", seed, 1, 4.0, "abc", "def", "python 3.11", "rays")
    return ResultRow("tiny", "plain", arm, "", *about, {"reached": value})


@given(st.lists(st.tuples(TEXT, VALUE), max_size=5))
def test_a_table_is_read_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, given: list[tuple[str, float]]
) -> None:
    rows = tuple(row(seed, arm, value) for seed, (arm, value) in enumerate(given))
    file = tmp_path_factory.mktemp("table") / "results.csv"
    file.write_text(table_text(ResultTable(("reached",), rows)), encoding="utf-8")
    found = read_table(file)
    assert table_text(found) == file.read_text(encoding="utf-8")
    assert [one.arm for one in found.rows] == [one.arm for one in rows]


@pytest.mark.parametrize("seed", [1_762_000_000, 2**63 - 1])
def test_a_seed_that_a_campaign_takes_can_be_read_back(tmp_path: Path, seed: int) -> None:
    file = tmp_path / "results.csv"
    file.write_text(table_text(ResultTable(("reached",), (row(seed),))))
    assert read_table(file).rows[0].seed == seed


@pytest.mark.parametrize(
    ("was", "is_now", "told"),
    [
        ("study,definitions", "studio,definitions", ":1: is no table of results"),
        (",0.5\n", ",half\n", ":2: reached: must be a number, is 'half'"),
        (",0.5\n", ",inf\n", ":2: reached: must be a number, is 'inf'"),
        (",0.5\n", "\n", ":2: has 12 fields, must have 13"),
        (",1,1,4,", ",one,1,4,", f":2: seed: must be a whole number from 0 to {2**63 - 1}, is 'one'"),
        (",1,1,4,", f",{2**63},1,4,", ":2: seed: must be a whole number from 0 to"),
        (",1,1,4,", ",1,1,-4,", ":2: seconds: is -4, must be from 1"),
        (",reached\n", ",reached,reached\n", ":1: a measure has two columns"),
    ],
)
def test_a_file_that_is_none_is_refused_with_its_line(tmp_path: Path, was: str, is_now: str, told: str) -> None:
    file = tmp_path / "results.csv"
    text = table_text(ResultTable(("reached",), (row(),)))
    assert was in text
    file.write_text(text.replace(was, is_now))
    with pytest.raises(BadTable) as refused:
        read_table(file)
    assert told in str(refused.value)


def test_a_run_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "results.csv"
    file.write_text(table_text(ResultTable(("reached",), (row(), row(2), row()))))
    with pytest.raises(BadTable, match=":4: is the run of line 2 once more"):
        read_table(file)


def test_a_second_run_of_a_seed_is_refused_under_any_number(tmp_path: Path) -> None:
    file = tmp_path / "results.csv"
    file.write_text(table_text(ResultTable(("reached",), (row(), row(2), replace(row(), number=99)))))
    with pytest.raises(BadTable, match=":4: is the run of line 2 once more"):
        read_table(file)


def test_runs_that_cannot_be_compared_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "results.csv"
    for other in (replace(row(2), seconds=9.0), replace(row(2), definitions="hard"), replace(row(2), renderer="egl")):
        file.write_text(table_text(ResultTable(("reached",), (row(), other))))
        with pytest.raises(BadTable, match=r":3: .* a table has one"):
            read_table(file)


@pytest.mark.parametrize("renderers", [("", "ray", "ray"), ("ray", "", "ray"), ("", "", "")])
def test_runs_without_pictures_are_compared_with_any(tmp_path: Path, renderers: tuple[str, ...]) -> None:
    file = tmp_path / "results.csv"
    rows = tuple(replace(row(seed), renderer=renderer) for seed, renderer in enumerate(renderers))
    file.write_text(table_text(ResultTable(("reached",), rows)))
    assert [each.renderer for each in read_table(file).rows] == list(renderers)
    file.write_text(
        table_text(ResultTable(("reached",), (*rows, replace(row(8), renderer="ray"), replace(row(9), renderer="egl"))))
    )
    with pytest.raises(BadTable, match=r":6: renderer: is 'egl', in line . 'ray': a table has one"):
        read_table(file)


def test_a_byte_order_mark_is_no_part_of_a_column(tmp_path: Path) -> None:
    file = tmp_path / "results.csv"
    file.write_text(table_text(ResultTable(("reached",), (row(),))), encoding="utf-8-sig")
    assert read_table(file).measures == ("reached",)
