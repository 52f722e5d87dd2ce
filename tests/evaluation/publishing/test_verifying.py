"""Results can be made again: a changed constant, a changed definition, a changed row are each found."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.evaluation.results.table import read_table
from regraft.evaluation.runs.fingerprint import versions
from tests.evaluation.app import command_line

pytestmark = pytest.mark.slow

STUDY = "tests.evaluation.tiny:STUDY"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the results of a campaign of two runs."""
    out = tmp_path_factory.mktemp("campaign")
    arguments = [STUDY, "--runs", "1", "--parallel", "2", "--out", str(out)]
    assert CliRunner().invoke(command_line(), ["evaluate", *arguments]).exit_code == 0
    return out / "results.csv"


def verify(file: Path, study: str = STUDY, sample: int = 1, seed: int = 1) -> tuple[int, str]:
    arguments = [str(file), "--study", study, "--sample", str(sample), "--seed", str(seed)]
    done = CliRunner().invoke(command_line(), ["evaluate", "verify", *arguments])
    return done.exit_code, done.output


def of_fast(results: Path, folder: Path, was: str = "", is_now: str = "") -> Path:
    """Return a copy of the results with the run of the arm ``fast`` alone, and one text of it replaced."""
    head, *rows = results.read_text().splitlines(keepends=True)
    (row,) = [row for row in rows if ",fast," in row]
    assert was in row
    copy = folder / "results.csv"
    copy.write_text(head + row.replace(was, is_now, 1))
    return copy


def test_a_campaign_writes_a_row_a_run_with_its_measures(results: Path) -> None:
    table = read_table(results)
    assert table.measures == ("reached",)
    assert [(row.arm, row.seed, row.seconds) for row in table.rows] == [("slow", 1, 4.0), ("fast", 1, 4.0)]
    assert len({row.digest for row in table.rows}) == 2


def test_what_did_not_change_comes_out_again(results: Path) -> None:
    code, told = verify(results, sample=2)
    assert code == 0, told
    assert "2 of 2 runs" in told


def test_a_changed_constant_is_found_by_digest_and_measure(results: Path, tmp_path: Path) -> None:
    code, told = verify(of_fast(results, tmp_path), "tests.evaluation.tiny:CONSTANT_CHANGED")
    assert code == 1
    assert "the digest is" in told
    assert "reached is" in told


def test_a_changed_definition_and_a_changed_row_are_found(results: Path, tmp_path: Path) -> None:
    code, told = verify(of_fast(results, tmp_path), "tests.evaluation.tiny:DEFINITION_CHANGED")
    assert (code, "the digest is" in told) == (1, False)
    assert "reached is" in told
    value = f"{read_table(results).rows[1].measures['reached']:g}"
    code, told = verify(of_fast(results, tmp_path, f",{value}", f",{value}1"))
    assert code == 1
    assert f"the table has {value}1" in told


def test_a_run_that_differs_is_shown_with_the_processor_that_the_table_was_made_with(
    results: Path, tmp_path: Path
) -> None:
    processor = f"processor {versions()['processor']}"
    other = of_fast(results, tmp_path, processor, "processor Abacus 3")
    assert verify(other)[0] == 0
    code, told = verify(other, "tests.evaluation.tiny:CONSTANT_CHANGED")
    assert code == 1
    assert "the table was made with processor Abacus 3" in told


def test_a_row_of_an_arm_that_is_gone_is_refused(results: Path, tmp_path: Path) -> None:
    code, told = verify(of_fast(results, tmp_path, ",fast,", ",furious,"))
    assert code == 2
    assert "no configuration 'furious'" in told


def test_a_table_without_runs_is_refused(results: Path, tmp_path: Path) -> None:
    empty = tmp_path / "results.csv"
    empty.write_text(results.read_text().splitlines()[0] + "\n")
    code, told = verify(empty)
    assert code == 2
    assert "has no runs" in told


def test_a_module_is_not_imported_because_a_table_names_it(results: Path, tmp_path: Path) -> None:
    file = of_fast(results, tmp_path, "tiny,", "os:path,")
    done = CliRunner().invoke(command_line(), ["evaluate", "verify", str(file)])
    assert done.exit_code == 2
    assert "name it by --study" in done.output


def test_a_file_in_place_of_a_folder_for_the_runs_is_refused(results: Path) -> None:
    done = CliRunner().invoke(command_line(), ["evaluate", "verify", str(results), "--out", str(results)])
    assert done.exit_code == 2
    assert "is there already" in done.output


def test_several_runs_of_one_seed_are_refused(results: Path, tmp_path: Path) -> None:
    file = of_fast(results, tmp_path)
    head, row = file.read_text().splitlines()
    file.write_text("\n".join((head, row, row.replace(",1,1,4,", ",1,2,4,"))) + "\n")
    code, told = verify(file)
    assert code == 2
    assert "has several runs of one seed" in told
