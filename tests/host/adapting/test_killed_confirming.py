"""A manager that is killed at any point of a confirmation, on real processes: all of it holds in the end, or none."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from regraft import CallFailed, run_directory
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
from tests.host.conftest import HEAD
from tests.host.processes.killing import TOPICS
from tests.support.machine.processes import kill
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

MANAGER = "adaptation_manager"
STACK = """\
  gauge: {class: 'tests.adaptation.watching.gauging:Gauge'}
  other: {class: 'tests.adaptation.watching.gauging:Gauge'}
  adaptation_manager:
    class: tests.host.adapting.dying:ToldManager
    parameters: {journal: $RUN/journal.sqlite, told: $RUN/told, died: $RUN/died}
    restart: {limit: 100, window: 30, backoff: 0.0}
"""
HOLDS = Condition(quality="gauge.level", at_least=4.0)
FINAL = "after it is final"


INITIAL = 5.0


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Return two gauges, and a manager that can be told where it is to be killed."""
    folder = tmp_path_factory.mktemp("confirming")
    head = HEAD.replace("  ticks: {type: host_tests/Tick}\n", TOPICS)
    (folder / "stack.yaml").write_text(head + STACK)
    with home(folder / "home"), all_ended() as started:
        started.append(System(folder / "stack.yaml"))
        started[0].wait_running(MANAGER)
        wait_until(lambda: started[0].client.last_measured("gauge"), "the gauge to measure")
        yield started[0]


def _dies_at(system: System, point: str) -> None:
    """Have the next run of the manager be killed at a point."""
    folder = run_directory.folder("tests")
    (folder / "died").unlink(missing_ok=True)
    (folder / "told").write_text(point)
    run = system.wait_running(MANAGER)
    kill(run.pid)
    system.wait_running(MANAGER, run.incarnation + 1)
    wait_until(lambda: not (folder / "told").exists(), "the manager to know")


def _request(shown: float, key: str, **more: Any) -> AdaptationRequest:
    changes = (SetParameters("gauge", {"shown": shown}), SetParameters("other", {"shown": shown}))
    return AdaptationRequest(changes, key=key, **more)


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
def test_a_manager_that_is_killed_there_leaves_nothing_half_done(system: System, point: str) -> None:
    assert _asked(system, _request(INITIAL, f"{point}, initially")).outcome is Outcome.APPLIED
    _dies_at(system, point)
    run = system.wait_running(MANAGER).incarnation
    shown = 3.0 if point in ("before it is withdrawn", "after it is undone") else 9.0
    report = _asked(system, _request(shown, f"{point}, first", confirm=0.6, watch=(HOLDS,)))
    assert (run_directory.folder("tests") / "died").exists()
    assert system.wait_running(MANAGER, run + 1)
    page = system.client.call(JOURNAL, JournalRequest(), JournalPage, PATIENCE)
    (line,) = [line for line in page.entries if line.request.key == f"{point}, first"]
    assert line.outcome is report.outcome
    if point == FINAL or point in ("before it notes how things are", "before its first step"):
        # It was final, or nothing had been written: it was asked for again.
        assert report.outcome is Outcome.APPLIED
        assert _shown(system) == {shown}
        return
    assert report.outcome is Outcome.ROLLED_BACK, report
    begun = point not in ("after its first step is written", "before it is confirming")
    assert [breach.code for breach in report.broken] == [BreachCode.INTERRUPTED] * begun
    assert _shown(system) == {INITIAL}
    assert _asked(system, _request(9.0, f"{point}, second", confirm=0.6, watch=(HOLDS,))).outcome is Outcome.APPLIED
    assert _shown(system) == {9.0}
