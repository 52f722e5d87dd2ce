"""The tables of pages are those of the results, and claims are older than the results that they are judged by."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from regraft.evaluation.claims.reading import read_claims
from regraft.evaluation.finding import find_study, studies
from regraft.evaluation.publishing.documents import filled
from regraft.evaluation.results.table import read_table
from tests.support.paths import ROOT

RESULTS = sorted((ROOT / "docs" / "results").glob("*.csv"))
PAGES = sorted((ROOT / "docs").glob("*.md"))


def test_every_table_of_a_page_is_that_of_its_results() -> None:
    pages = [page for page in PAGES if "<!-- table: " in page.read_text() and page.name != "studies.md"]
    assert [page.name for page in pages if filled(page) != page.read_text()] == []


def test_every_file_of_claims_can_be_read() -> None:
    for study in studies().values():
        for definitions, file in study.claims.items():
            claims = read_claims(file, study)
            assert claims.claims
            assert claims.definitions == definitions


@pytest.mark.parametrize("file", RESULTS, ids=lambda file: file.name)
def test_results_name_a_study_and_arms_that_there_are(file: Path) -> None:
    table = read_table(file)
    for row in table.rows:
        keys = {each.key for each in find_study(row.study).configurations[row.definitions]}
        assert row.configuration in keys
        assert row.digest
        assert row.code


def first_commit(file: Path) -> int | None:
    """Return when a file came into the repository (s since 1970), None if it is not known."""
    command = ["git", "log", "--follow", "--format=%ct", "--reverse", "--", str(file)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    times = done.stdout.split()
    return int(times[0]) if done.returncode == 0 and times else None


@pytest.mark.parametrize("file", RESULTS, ids=lambda file: file.name)
def test_claims_are_older_than_the_results_of_their_seeds(file: Path) -> None:
    row = read_table(file).rows[0]
    claims = find_study(row.study).claims.get(row.definitions)
    if claims is None:
        pytest.skip("the study claims nothing")
    claimed, found = first_commit(claims), first_commit(file)
    if claimed is None or found is None:
        pytest.skip("there is no history here")
    assert claimed < found
