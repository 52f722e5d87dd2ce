"""A page's tables are those of its results: a changed row, or a changed table, is found."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.evaluation.publishing.documents import BadPage, filled
from regraft.evaluation.results.table import ResultRow, ResultTable, table_text
from tests.evaluation.app import command_line

PAGE = """\
# Counting

<!-- table: measures; of: results/tiny.csv; use: reporting; measures: reached -->
<!-- end of table -->

Text of ours.

<!-- table: same; of: results/tiny.csv; measures: reached -->
<!-- end of table -->
<!-- table: rows; of: results/tiny.csv; measures: reached -->
<!-- end of table -->
<!-- table: runs; of: results/tiny.csv -->
old
<!-- end of table -->
"""


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """Return a page with two arms of ten runs each; a third did as the second."""
    (tmp_path / "results").mkdir()
    rows = [
        ResultRow(
            "tiny",
            "plain",
            arm,
            "",
            "reporting",
            seed,
            1,
            4.0,
            f"{by}{seed}",
            "c0de",
            "python",
            "",
            {"reached": by * seed},
        )
        for arm, by in (("slow", 1.0), ("fast", 2.0), ("quick", 2.0))
        for seed in range(1, 11)
    ]
    (tmp_path / "results" / "tiny.csv").write_text(table_text(ResultTable(("reached",), tuple(rows))))
    file = tmp_path / "page.md"
    file.write_text(PAGE)
    return file


def tables(*arguments: str) -> tuple[int, str]:
    done = CliRunner().invoke(command_line(), ["evaluate", "tables", *arguments])
    return done.exit_code, done.output


def test_tables_are_filled_and_text_is_kept(page: Path) -> None:
    assert tables(str(page))[0] == 0
    text = page.read_text()
    assert "| `slow` | 10 | 5.50 ± 3.03 |" in text
    assert "| `fast`, `quick` | 10 | 11.0 ± 6.1 |" in text
    assert "| `quick` | 10 | 20.0 |" in text
    assert "`fast` and `quick` did the same in every run." in text
    assert "| reporting | 30 | 3 | 1 to 10 | 4 s | `c0de` |" in text
    assert "\nText of ours.\n" in text
    assert "old" not in text
    assert filled(page) == text


def test_a_changed_row_makes_the_check_fail_and_changes_nothing(page: Path) -> None:
    tables(str(page))
    assert tables("--check", str(page))[0] == 0
    results = page.parent / "results" / "tiny.csv"
    results.write_text(results.read_text().replace(",10\n", ",11\n"))
    before = page.read_bytes()
    code, told = tables("--check", str(page))
    assert (code, page.read_bytes()) == (1, before)
    assert f"{page}: stale" in told


def test_a_figure_changed_by_hand_makes_the_check_fail(page: Path) -> None:
    tables(str(page))
    page.write_text(page.read_text().replace("5.50", "5.60"))
    assert tables("--check", str(page))[0] == 1


@pytest.mark.parametrize(
    ("was", "is_now", "told"),
    [
        ("table: same", "table: some", ":8: there is no table 'some'; did you mean 'same'"),
        ("; use: reporting", "; use: report", ":3: use: there is no use 'report'; did you mean 'reporting'"),
        (
            "measures: reached -->\n<!-- end of table -->\n\nText",
            "measures: reach -->\n<!-- end of table -->\n\nText",
            ":3: measures: there is none 'reach'",
        ),
        ("; use: reporting", "; scenario: dark", ":3: scenario: there is none 'dark'"),
        ("; use: reporting", "; user: reporting", ":3: a table 'measures' has no field 'user'; did you mean 'use'"),
        ("table: runs; of: results/tiny.csv", "table: runs", ":12: of: is missing"),
        (
            "table: runs; of: results/tiny.csv",
            "table: verdicts; of: results/tiny.csv; study: tests.evaluation.tiny:STUDY",
            ":12: results/tiny.csv is of no study with claims",
        ),
        ("; use: reporting", "; use: tuning", ":3: use: there is no use 'tuning'"),
        ("; use: reporting", "; use: reporting; use: reporting", ":3: use: is given twice"),
        (
            "table: runs; of: results/tiny.csv",
            "table: runs; of: results/tiny.csv; scenario: x",
            ":12: a table 'runs' has no field",
        ),
        ("<!-- table: same", "<!--table: same", ":8: is no mark of a table"),
        ("<!-- table: same", "<!-- Table: same", ":8: is no mark of a table"),
        (
            "measures: reached -->\n<!-- end of table -->\n\nText",
            "measures: reached --> \n<!-- end of table -->\n\nText",
            ":3: is no mark of a table",
        ),
        ("Text of ours.", "<!-- end of table -->", ":6: is no mark of a table"),
        ("old\n<!-- end of table -->\n", "old\n", ":12: a table has no end"),
    ],
)
def test_a_mark_that_means_nothing_is_refused_with_its_line(page: Path, was: str, is_now: str, told: str) -> None:
    assert was in PAGE
    page.write_text(PAGE.replace(was, is_now, 1))
    with pytest.raises(BadPage) as refused:
        filled(page)
    assert told in str(refused.value)
    assert tables(str(page))[0] == 2


def test_a_table_that_is_not_there_is_refused(page: Path) -> None:
    page.write_text(PAGE.replace("results/tiny.csv", "results/none.csv"))
    code, told = tables(str(page))
    assert code == 2
    assert "No such file" in told


def test_an_example_in_a_fence_is_no_table(page: Path) -> None:
    example = "```html\n<!-- table: measures; of: results/none.csv -->\n```\n"
    page.write_text(PAGE + example)
    assert tables(str(page))[0] == 0
    assert page.read_text().endswith(example)


def test_of_several_pages_none_is_changed_if_one_is_wrong(page: Path) -> None:
    wrong = page.with_name("wrong.md")
    wrong.write_text("<!-- table: nothing -->\n")
    assert tables(str(page), str(wrong))[0] == 2
    assert page.read_text() == PAGE
