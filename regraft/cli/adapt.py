"""``regraft adapt``, ``undo`` and ``journal``: changing a system, and what has been changed."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from typing import Annotated

import typer

from bus_schema import codec
from bus_schema.adaptation import AdaptationReport, AdaptationRequest
from bus_schema.errors import BadMessage
from bus_schema.messages.manager import JournalPage, JournalRequest, UndoAdaptation
from regraft.cli import managing
from regraft.cli.group import BadInput
from regraft.cli.options import JsonOption, ReasonOption, SystemOption, TimeoutOption
from regraft.cli.output import say, seconds, show_json, show_table
from regraft.cli.reach import reached, user
from regraft.cli.topology import topology
from regraft.cli.values import read_document


def adapt(
    ctx: typer.Context,
    file: Annotated[
        str,
        typer.Argument(metavar="FILE", help="An adaptation request in YAML or JSON; - for standard input."),
    ],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would be done, and touch nothing.")] = False,
    reason: ReasonOption = "",
    revision: Annotated[
        int | None,
        typer.Option("--if-revision", metavar="N", min=0, help="Refuse if the revision is another."),
    ] = None,
    timeout: TimeoutOption = managing.ADAPTATION_WITHIN,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Carry out an adaptation: all of its changes, or none."""
    request = request_of(file)
    request = replace(
        request,
        dry_run=dry_run or request.dry_run,
        reason=reason or request.reason,
        who=request.who or user(),
        revision=revision if revision is not None else request.revision,
    )
    with reached(ctx, system) as there:
        managing.show_report(managing.adapt(there, request, timeout), as_json=as_json)


def request_of(file: str) -> AdaptationRequest:
    """Return the adaptation request in a file; raises BadInput."""
    try:
        return codec.from_plain(read_document(file), AdaptationRequest)
    except BadMessage as error:
        raise BadInput(f"{file}: {error}") from None


def undo(
    ctx: typer.Context,
    adaptation: Annotated[str, typer.Argument(metavar="ID", help="The adaptation's id in the journal.")],
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Undo an applied adaptation by a new one."""
    with reached(ctx, system) as there:
        managing.require_manager(topology(there))
        request = UndoAdaptation(adaptation, user(), reason)
        report = there.client.call(managing.UNDO, request, AdaptationReport, managing.ADAPTATION_WITHIN)
        managing.show_report(report, as_json=as_json)


def journal(
    ctx: typer.Context,
    adaptation: Annotated[str, typer.Argument(metavar="[ID]", help="Show this adaptation, step by step.")] = "",
    limit: Annotated[int, typer.Option("--limit", metavar="N", min=1, max=500, help="How many, newest first.")] = 20,
    before: Annotated[str, typer.Option("--before", metavar="ID", help="Only older ones than this.")] = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the adaptations of this run, newest first."""
    with reached(ctx, system) as there:
        managing.require_manager(topology(there))
        page = there.client.call(managing.JOURNAL, JournalRequest(adaptation, before, limit), JournalPage)
    if adaptation and not page.entries:
        raise BadInput(f"the journal of this run has no adaptation {adaptation!r}")
    if as_json:
        show_json(page.entries[0] if adaptation else page)
    elif adaptation:
        _show_entry(page.entries[0])
    else:
        show_table(
            ("id", "time", "outcome", "revision", "took", "who", "reason"),
            [_row(entry, simulated=there.info.simulated) for entry in page.entries],
            empty="no adaptations",
        )


def _row(report: AdaptationReport, *, simulated: bool) -> tuple[object, ...]:
    clock_time = time.strftime("%H:%M:%S", time.localtime(report.started))
    return (
        report.id,
        f"{report.started:.2f} s" if simulated else clock_time,
        report.outcome.value,
        report.revision_after,
        seconds(report.duration),
        report.request.who,
        report.request.reason,
    )


def _show_entry(report: AdaptationReport) -> None:
    say(managing.headline(report))
    say(f"by {report.request.who or 'nobody known'}, because: {report.request.reason or 'no reason given'}")
    for change in codec.to_plain(report.request)["changes"]:
        say(f"  {change.pop('change')}: {', '.join(f'{name} {value}' for name, value in change.items())}")
    for name, value in report.request.context.items():
        say(f"  {name}: {json.dumps(value, default=str) if isinstance(value, dict | list) else value}")
    for violation in report.violations:
        say(f"  violation: {managing.violation_line(violation)}")
    for step in report.steps:
        say(f"  {managing.step_line(step)}")
