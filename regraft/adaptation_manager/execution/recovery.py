"""Recovery when a manager returns: adaptations begun and not ended are undone and closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from regraft.adaptation_manager.execution.transaction import undo
from regraft.adaptation_manager.journal.journal import Journal, OpenLine
from regraft.adaptation_manager.planning.plan import way
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, StepState
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.watched import Breach, BreachCode

INTERRUPTED = "interrupted: the manager was restarted"
DAMAGED = "the journal has lost how"


async def recover(
    journal: Journal, current: Architecture, site_for: Callable[[Architecture, Architecture], ExecutionContext]
) -> list[AdaptationReport]:
    """Undo every open line of the journal, the newest first; returns how each ended. Raises JournalError."""
    ended = []
    for line in journal.open_lines():
        report = await _undone(line, current, site_for)
        journal.end(report)
        ended.append(report)
    return ended


async def _undone(
    line: OpenLine, current: Architecture, site_for: Callable[[Architecture, Architecture], ExecutionContext]
) -> AdaptationReport:
    reports, planned, readable = list(line.report.steps), [], []
    for index, step in enumerate(line.steps):
        if step is None:
            reports[index] = replace(reports[index], state=StepState.UNDO_FAILED, error=DAMAGED)
        else:
            planned.append(step[0])
            readable.append(replace(reports[index], state=step[1]))
    problems = [DAMAGED] if line.following is None or len(readable) < len(reports) else []
    following = line.following or UpdateSpecs(line.report.revision_after)
    after = following.applied_to(current)
    context = site_for(current, after)
    unreached = [each.component for each in line.report.unreached]
    problems += await undo(context, way(after, current), tuple(planned), readable, unreached)
    undone = {step.number: step for step in readable}
    error = f"{INTERRUPTED}; could not be undone: {'; '.join(problems)}" if problems else INTERRUPTED
    return replace(
        line.report,
        outcome=Outcome.STUCK if problems else Outcome.ROLLED_BACK,
        revision_after=line.report.revision_before,
        steps=tuple(undone.get(step.number, step) for step in reports),
        error=error,
        unreached=context.unreached(line.report),
        broken=(Breach(BreachCode.INTERRUPTED, INTERRUPTED),) if line.report.outcome is Outcome.CONFIRMING else (),
    )
