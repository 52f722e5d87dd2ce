"""A run that its recorder ends is the same one, however late the campaign sees its last row."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from regraft.evaluation.campaign import Campaign, Wanted
from regraft.evaluation.results.recording import digest_of
from regraft.evaluation.rows import ends_with_last_row
from regraft.evaluation.runs import run_process
from tests.evaluation.tiny import CONFIRMING
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow


def made(out: Path) -> tuple[str, str]:
    """Return the adaptations and the digest of the study's first run."""
    configurations = tuple(CONFIRMING.configurations["plain"][:1])
    campaign = Campaign(Wanted(CONFIRMING, "plain", configurations, 1, 1, CONFIRMING.seconds), out)
    said: list[str] = []
    with campaign.opened(resume=False):
        campaign.run(lambda _: None, said.append)
    (run,) = campaign.results().runs or [pytest.fail("\n".join(said))]
    return (out / "runs" / "slow" / "001" / "adaptations.csv").read_text(), digest_of(run)


def is_confirmed(journal: Path) -> bool:
    """Return whether the adaptation of a run has ended."""
    with closing(sqlite3.connect(journal)) as opened:
        found = opened.execute("SELECT outcome FROM adaptations WHERE actor = 'adapter'").fetchall()
    return found == [("applied",)]


def test_an_adaptation_that_is_confirmed_after_the_last_row_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ends_late(rows: Path) -> bool:
        if ends_with_last_row(rows):
            wait_until(lambda: is_confirmed(rows.with_name("journal.sqlite")), "the adaptation is confirmed", 60.0)
            return True
        return False

    soon = made(tmp_path / "soon")
    monkeypatch.setattr(run_process, "ends_with_last_row", ends_late)
    assert made(tmp_path / "late") == soon
    assert [line.split(",")[1] for line in soon[0].splitlines()] == ["outcome", "confirming"]
