"""What a manager finds when it returns: adaptations begun and not ended. They are undone, and closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from adaptation_manager.journal import Journal, OpenLine
from adaptation_manager.plan import way
from adaptation_manager.site import Site
from adaptation_manager.transaction import undo
from bus_schema.adaptation import AdaptationReport, Outcome
from bus_schema.architecture import Architecture

INTERRUPTED = "interrupted: the manager was restarted"


async def recover(
    journal: Journal, current: Architecture, site_for: Callable[[Architecture, Architecture], Site]
) -> list[AdaptationReport]:
    """Undo every open line of the journal, the newest first; returns how each ended. Raises JournalError."""
    ended = []
    for line in journal.open_lines():
        report = await _undone(line, current, site_for)
        journal.end(report)
        ended.append(report)
    return ended


async def _undone(
    line: OpenLine, current: Architecture, site_for: Callable[[Architecture, Architecture], Site]
) -> AdaptationReport:
    after = line.following.applied_to(current)
    reports = [replace(report, state=state) for report, (_, state) in zip(line.report.steps, line.steps, strict=True)]
    planned = tuple(step for step, _ in line.steps)
    problems = await undo(site_for(current, after), way(after, current), planned, reports)
    error = f"{INTERRUPTED}; could not be undone: {'; '.join(problems)}" if problems else INTERRUPTED
    return replace(
        line.report,
        outcome=Outcome.STUCK if problems else Outcome.ROLLED_BACK,
        revision_after=line.report.revision_before,
        steps=tuple(reports),
        error=error,
    )
