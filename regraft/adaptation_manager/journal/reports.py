"""Reports of adaptations: as they begin, and in words."""

from __future__ import annotations

from regraft.adaptation_manager.queue.adaptation_queue import Entry
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome

EVENTS = {
    Outcome.APPLIED: "adaptation.applied",
    Outcome.APPLIED_STATE_LOST: "adaptation.applied_state_lost",
    Outcome.REJECTED: "adaptation.rejected",
    Outcome.ROLLED_BACK: "adaptation.rolled_back",
    Outcome.CANCELLED: "adaptation.cancelled",
    Outcome.STUCK: "adaptation.stuck",
}
"""The kind of event for each outcome."""


def pending(entry: Entry, revision: int, now: float, tick: int | None) -> AdaptationReport:
    """Return the report of an adaptation that has not ended; ``id`` is empty for one without a line."""
    if entry.shown is not None:
        return entry.shown
    number = str(entry.number) if entry.number else ""
    return AdaptationReport(number, Outcome.PENDING, entry.request, revision, revision, now, tick=tick)


def summary(report: AdaptationReport) -> str:
    """Describe in one line what became of an adaptation."""
    text = f"adaptation {report.id or '-'} {report.outcome.value}"
    if report.request.reason:
        text += f" ({report.request.reason})"
    if report.violations:
        text += ": " + "; ".join(map(str, report.violations))
    elif report.error:
        text += f": {report.error}"
    return text[:2000]
