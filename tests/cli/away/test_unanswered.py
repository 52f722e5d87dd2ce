"""An adaptation whose answer does not come may still happen: its sender finds it, and can cancel it."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import Component, service
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest, UndoAdaptation
from regraft.bus_schema.model.adaptation import ADAPT, JOURNAL, UNDO, AdaptationReport, AdaptationRequest, Outcome
from regraft.cli.outcomes import FAILED
from tests.cli.away.test_ended import FOR_LONG, running
from tests.cli.live import regraft
from tests.support.stepped.site import Site

NO_CHANGE = AdaptationRequest((), "someone is near", "ana")


class Busy(Component):
    """Has an adaptation that waits, and answers none."""

    @service(ADAPT)
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Never answer."""
        return await self._never()

    @service(UNDO)
    async def undo(self, request: UndoAdaptation) -> AdaptationReport:
        """Never answer."""
        return await self._never()

    async def _never(self) -> AdaptationReport:
        await self.kit.sleep(FOR_LONG)
        raise AssertionError

    @service(JOURNAL)
    def lines(self, request: JournalRequest) -> JournalPage:
        """Show one that has ended, and one that waits."""
        ended = AdaptationReport("2", Outcome.APPLIED, NO_CHANGE, 1, 2, 1.0)
        return JournalPage((ended,), waiting=(AdaptationReport("3", Outcome.PENDING, NO_CHANGE, 2, 2, 5.0),))


@pytest.fixture
def busy(home: Path) -> Iterator[Path]:
    """Run a system whose manager is busy; returns its home."""
    over = threading.Event()
    site = Site("zenoh")
    try:
        site.start(Busy, "adaptation_manager")
        with running(site, over):
            yield home
    finally:
        over.set()
        site.close()


def test_the_journal_begins_with_those_that_wait(busy: Path) -> None:
    rows = [line.split() for line in regraft(busy, "journal").stdout.splitlines()[1:]]
    assert [(row[0], "waiting" in row) for row in rows] == [("3", True), ("2", False)]
    page = json.loads(regraft(busy, "journal", "--json").stdout)
    assert [report["id"] for report in page["waiting"]] == ["3"]


@pytest.mark.parametrize("words", [("adapt", "FILE"), ("undo", "2")], ids=" ".join)
def test_an_adaptation_without_an_answer_names_where_it_is_found(
    busy: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    (tmp_path / "FILE").write_text(json.dumps({"changes": [], "reason": "near"}))
    typed = [str(tmp_path / word) if word == "FILE" else word for word in words]
    done = regraft(busy, *typed, "--timeout", "0.5", "--json")
    assert done.returncode == FAILED, done
    error = json.loads(done.stderr)
    assert error["code"] == "no_answer"
    assert "'regraft journal'" in error["error"]
    tried = regraft(busy, *typed, "--timeout", "0.5", "--dry-run", "--json")
    assert "'regraft journal'" not in json.loads(tried.stderr)["error"]
