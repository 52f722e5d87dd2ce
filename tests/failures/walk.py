"""One failure: an adaptation, a fault on its way, and what stands afterwards."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace

from regraft import CallFailed
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest, UndoAdaptation
from regraft.bus_schema.model.adaptation import (
    APPLIED,
    AdaptationReport,
    AdaptationRequest,
    Change,
    Move,
    Outcome,
    Swap,
)
from tests.failures.injecting import Fault
from tests.failures.kinds import WITH_A_GAP
from tests.failures.observing import Standings, architecture, delivered, disagreements, settled
from tests.failures.place import Place
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

MANAGER = "adaptation_manager"
FIRST = "local"
Arrived = dict[str, dict[str, dict[str, int]]]
UNTOUCHED = (Outcome.REJECTED, Outcome.ROLLED_BACK, Outcome.CANCELLED)


@dataclass(frozen=True, slots=True)
class Walk:
    """One kind of change, and one fault."""

    kind: str
    changes: tuple[Change, ...]
    fault: Fault
    component: str
    """Whom the step concerns at which the fault happens."""

    def __str__(self) -> str:
        return f"{self.kind}, {self.fault} ({self.component})"


def plan(system: System, changes: tuple[Change, ...]) -> tuple[str, ...]:
    """Return whom each step of the changes concerns."""
    report = _adapt(system, AdaptationRequest(changes, dry_run=True))
    assert report.steps, report.violations
    return tuple(step.component for step in report.steps)


def walk(place: Place, one: Walk) -> Outcome:
    """Adapt with a fault on the way, check what stands, and undo it if it was applied; returns the outcome."""
    system = place.system
    before, arrived, hung = settled(system, *place.guests), delivered(system), _hung(system, one)
    differences = disagreements(before, architecture(system))
    assert not differences, differences
    one.fault.prepare(place.folder)
    report = _ended(system, _adapt(system, AdaptationRequest(one.changes, reason=str(one), key=_key())))
    happened = one.fault.withdraw(place.folder)
    shutil.rmtree(place.folder / "flags", ignore_errors=True)
    if happened and one.fault.kills_host:
        place.complete()
    after = settled(system, *place.guests)
    _judge(one, report, before, after)
    assert disagreements(after, architecture(system)) == [], report
    # On a busy machine somebody who is late may have been taken for hung.
    died = one.fault.how != "late" or _hung(system, one) > hung
    _judge_data(system, one, arrived, report.outcome, died=died and one.fault.who != "manager")
    if report.outcome in APPLIED:
        undone = _ended(system, _undo(system, report.id))
        assert undone.outcome is Outcome.APPLIED, undone
        assert _values(settled(system, *place.guests)) == _values(before)
    return report.outcome


def _judge(one: Walk, report: AdaptationReport, before: Standings, after: Standings) -> None:
    struck = {MANAGER if one.fault.who == "manager" else one.component}
    if one.fault.who == "host":
        struck = {name for standings in (before, after) for name in standings if standings[name].host != FIRST}
    assert report.outcome in (*UNTOUCHED, *APPLIED), report
    if report.outcome in UNTOUCHED:
        assert _values(after) == _values(before), report
    others = struck
    if report.outcome in APPLIED:
        others = others | {change.component for change in one.changes if isinstance(change, Swap | Move)}
    same = (after.keys() & before.keys()) - others
    assert {name: after[name].pid for name in same} == {name: before[name].pid for name in same}, report


def _values(standings: Standings) -> Standings:
    return {name: replace(standing, pid=0) for name, standing in standings.items()}


def _hung(system: System, one: Walk) -> int:
    return len(system.said("component.hung", one.component))


def _judge_data(system: System, one: Walk, arrived: Arrived, outcome: Outcome, *, died: bool) -> None:
    """Whoever did not die has lost and doubled nothing; and what is to flow flows.

    What came as a run died that had to hand over may have been handled by it and by its successor.
    """
    now = delivered(system)
    for line, tracks in now.items():
        for origin, track in tracks.items():
            then = arrived[line].get(origin, {"lost": 0, "doubled": 0})
            if outcome is not Outcome.APPLIED_STATE_LOST:
                assert track["doubled"] == then["doubled"], (line, origin, now, arrived)
            if not died and one.kind not in WITH_A_GAP:
                assert track["lost"] == then["lost"], (line, origin, now, arrived)
    heard = _heard(now, "relayed")
    wait_until(lambda: _heard(delivered(system), "relayed") > heard, "numbers to flow")


def _heard(lines: dict[str, dict[str, dict[str, int]]], line: str) -> int:
    return sum(track["heard"] for track in lines[line].values())


_keys = iter(range(1_000_000))


def _key() -> str:
    return f"walk-{next(_keys)}"


def _adapt(system: System, request: AdaptationRequest) -> AdaptationReport:
    return system.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)


def _undo(system: System, number: str) -> AdaptationReport:
    return system.client.call("adaptation_manager/undo", UndoAdaptation(number), AdaptationReport, PATIENCE)


def _ended(system: System, report: AdaptationReport) -> AdaptationReport:
    """Return an adaptation's line in the journal, once it has ended."""
    lines: list[AdaptationReport] = []

    def over() -> bool:
        try:
            page = system.client.call("adaptation_manager/journal", JournalRequest(report.id), JournalPage, 2.0)
        except CallFailed:
            return False
        lines[:] = page.entries
        return bool(lines) and lines[0].outcome is not Outcome.PENDING

    wait_until(over, f"the end of adaptation {report.id}")
    return lines[0]
