"""A manager that is killed at any point of a confirmation, on real processes: all of it holds in the end, or none."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    JOURNAL,
    AdaptationReport,
    AdaptationRequest,
    Outcome,
    SetParameters,
)
from regraft.bus_schema.model.watched import BreachCode, Condition
from tests.adaptation.watching.gauging import POINTS
from tests.host.conftest import HEAD, Start
from tests.host.killing import TOPICS
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

MANAGER = "adaptation_manager"
STACK = """\
  gauge: {{class: 'tests.adaptation.watching.gauging:Gauge'}}
  other: {{class: 'tests.adaptation.watching.gauging:Gauge'}}
  adaptation_manager:
    class: tests.adaptation.watching.gauging:DyingManager
    parameters: {{journal: $RUN/journal.sqlite, point: {point}, died: {died}}}
    restart: {{limit: 10, window: 30, backoff: 0.0}}
"""
HOLDS = Condition(quality="gauge.level", at_least=4.0)
FINAL = "after it is final"


def _request(shown: float, key: str) -> AdaptationRequest:
    changes = (SetParameters("gauge", {"shown": shown}), SetParameters("other", {"shown": shown}))
    return AdaptationRequest(changes, key=key, confirm=0.6, watch=(HOLDS,))


def _asked(system: System, request: AdaptationRequest) -> AdaptationReport:
    """Ask until there is an answer; the same key is the same adaptation."""
    while True:
        try:
            return system.client.call(ADAPT, request, AdaptationReport, PATIENCE, patient=True)
        except CallFailed as error:
            if error.answer is not None and "only while active" not in error.why:
                raise


def _shown(system: System) -> set[object]:
    return {system.client.view(name).parameters["shown"] for name in ("gauge", "other")}


@pytest.mark.parametrize("point", POINTS)
def test_a_manager_that_is_killed_there_leaves_nothing_half_done(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, point: str
) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD.replace("  ticks: {type: host_tests/Tick}\n", TOPICS))
    died = tmp_path / "died"
    system = start(STACK.format(point=point, died=died))
    system.wait_running(MANAGER)
    wait_until(lambda: system.client.last_measured("gauge"), "the gauge to measure")
    shown = 3.0 if point in ("before it is withdrawn", "after it is undone") else 9.0
    report = _asked(system, _request(shown, "first"))
    assert died.exists()
    assert system.wait_running(MANAGER, 2)
    page = system.client.call(JOURNAL, JournalRequest(), JournalPage, PATIENCE)
    (line,) = [line for line in page.entries if line.request.key == "first"]
    assert line.outcome is report.outcome
    if point == FINAL or point in ("before it notes how things are", "before its first step"):
        # It was final, or nothing had been written: it was asked for again.
        assert report.outcome is Outcome.APPLIED
        assert _shown(system) == {shown}
        return
    assert report.outcome is Outcome.ROLLED_BACK, report
    begun = point not in ("after its first step is written", "before it is confirming")
    assert [breach.code for breach in report.broken] == [BreachCode.INTERRUPTED] * begun
    assert _shown(system) == {5.0}
    assert _asked(system, _request(9.0, "second")).outcome is Outcome.APPLIED
    assert _shown(system) == {9.0}
