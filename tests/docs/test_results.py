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

pytestmark = pytest.mark.slow

RESULTS = sorted((ROOT / "docs" / "results").glob("*.csv"))
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def test_every_table_of_a_page_is_that_of_its_results() -> None:
    assert [page.name for page in PAGES if filled(page) != page.read_text()] == []


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


def commits(file: Path) -> list[str]:
    """Return the commits that changed a file, the newest first; none where there is no history."""
    done = subprocess.run(
        ["git", "log", "--format=%H", "--", str(file)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return done.stdout.split() if done.returncode == 0 else []


@pytest.mark.parametrize("file", RESULTS, ids=lambda file: file.name)
def test_claims_have_not_changed_since_the_results_of_their_seeds(file: Path) -> None:
    """The last commit of the claims comes before the first one of the results; the table has their uses of seeds."""
    (row, *_) = rows = read_table(file).rows
    study = find_study(row.study)
    path = study.claims.get(row.definitions)
    if path is None:
        pytest.skip("the study claims nothing")
    claims = read_claims(path, study)
    assert [(each.seed, each.use) for each in rows if each.use != getattr(claims.set_of(each.seed), "value", "")] == []
    claimed, found = commits(path), commits(file)
    if not claimed or not found:
        pytest.skip("there is no history here")
    command = ["git", "merge-base", "--is-ancestor", claimed[0], found[-1]]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode == 0
    assert claimed[0] != found[-1]
