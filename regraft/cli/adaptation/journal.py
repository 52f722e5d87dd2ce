"""``regraft journal``: what has been changed, by whom, why, and how."""

from __future__ import annotations

import json
import time
from typing import Annotated, Any

import typer

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.messages.management.system import SystemFault
from regraft.bus_schema.model.adaptation import JOURNAL, AdaptationReport
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.adapt import undo
from regraft.cli.adaptation.mistakes import violation_line
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.numbers import whole
from regraft.cli.terminal.options import JsonOption, SystemOption
from regraft.cli.terminal.output import say, seconds, show_json, show_table
from regraft.client.diff import ArchitectureDiff, Difference, diff

journal = typer.Typer(help="List the adaptations of this run, newest first.", rich_markup_mode=None)

LIMIT = 20
"""Adaptations that the list has if nobody asks for more."""

IdArgument = Annotated[str, typer.Argument(metavar="ID", help="The adaptation's id in the journal.")]


@journal.callback(invoke_without_command=True)
def list_lines(
    ctx: typer.Context,
    limit: Annotated[
        int, typer.Option("--limit", metavar="N", parser=whole(1, 500), help="How many, newest first.")
    ] = LIMIT,
    before: Annotated[str, typer.Option("--before", metavar="ID", help="Only older ones than this.")] = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the adaptations of this run, newest first; one of them, what it changed, undo it: by the commands below."""
    if ctx.invoked_subcommand is not None:
        if limit != LIMIT or before:
            raise BadInput(f"--limit and --before are for the list: {ctx.invoked_subcommand!r} takes neither")
        return
    with reached(ctx, system) as there:
        page = _page(there, JournalRequest("", before, limit))
    if as_json:
        show_json(page)
        return
    show_table(
        ("id", "time", "outcome", "revision", "took", "actor", "reason"),
        _rows(page, simulated=there.info.simulated),
        empty="no adaptations",
    )


@journal.command()
def show(ctx: typer.Context, adaptation: IdArgument, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Show an adaptation: who asked for it and why, its phases and steps, and what it changed."""
    with reached(ctx, system) as there:
        page = _page(there, JournalRequest(adaptation))
        if not page.entries:
            raise BadInput(f"the journal of this run has no adaptation {adaptation!r}")
        (entry,) = page.entries
        changed = None
        if entry.revision_after != entry.revision_before and entry.revision_before:
            changed = _diff(there, entry.revision_before, entry.revision_after)
    if as_json:
        shown = codec.to_plain(entry)
        show_json(shown if changed is None else shown | {"differences": _plain(changed)})
        return
    _show_entry(entry)
    if changed is not None:
        _show_differences(changed)


@journal.command("diff")
def show_diff(
    ctx: typer.Context,
    before: Annotated[int, typer.Argument(metavar="REVISION", parser=whole(0), help="The earlier one.")],
    after: Annotated[int, typer.Argument(metavar="REVISION", parser=whole(0), help="The later one.")],
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show how two revisions of the architecture differ."""
    with reached(ctx, system) as there:
        managing.require_manager(there)
        changed = _diff(there, before, after)
    if as_json:
        show_json({"before": before, "after": after, "differences": _plain(changed)})
        return
    say(f"revision {before} to {after}" + ("" if changed.differences else ": no difference"))
    _show_differences(changed)


journal.command("undo")(undo)


def _page(there: Reached, request: JournalRequest) -> JournalPage:
    return managing.ask(there, JOURNAL, request, JournalPage)


def _diff(there: Reached, before: int, after: int) -> ArchitectureDiff:
    return diff(there.client.architecture(before), there.client.architecture(after))


def _plain(changed: ArchitectureDiff) -> list[dict[str, Any]]:
    return [{"path": d.path, "kind": d.kind, "before": d.before, "after": d.after} for d in changed.differences]


def _show_differences(changed: ArchitectureDiff) -> None:
    for difference in changed.differences:
        say(f"  {difference_line(difference)}")


def difference_line(difference: Difference) -> str:
    """Return a difference as one line: a sign, the path, what it was and is."""
    sign = {"added": "+", "removed": "-"}.get(difference.kind, "~")
    values = (
        [difference.before, difference.after]
        if sign == "~"
        else [difference.after if sign == "+" else difference.before]
    )
    return f"{sign} {difference.path}: {' -> '.join(map(_short, values))}"


def _short(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 100 else f"{text[:97]}..."


def _rows(page: JournalPage, *, simulated: bool) -> list[tuple[object, ...]]:
    """Return those that wait, then adaptations and faults, newest first."""
    waiting = [(w.id, "", "waiting", "", "", w.request.actor, w.request.reason) for w in page.waiting]
    rows = [(entry.started, _row(entry, simulated=simulated)) for entry in page.entries]
    rows += [(fault.stamp, _fault_row(fault, simulated=simulated)) for fault in page.faults]
    return waiting + [row for _, row in sorted(rows, key=lambda one: one[0], reverse=True)]


def _fault_row(fault: SystemFault, *, simulated: bool) -> tuple[object, ...]:
    text = " ".join(fault.text.split())
    return ("", _shown_time(fault.stamp, simulated=simulated), fault.kind.value, "", "", fault.component, text)


def _shown_time(stamp: float, *, simulated: bool) -> str:
    return f"{stamp:.2f} s" if simulated else time.strftime("%H:%M:%S", time.localtime(stamp))


def _row(report: AdaptationReport, *, simulated: bool) -> tuple[object, ...]:
    return (
        report.id,
        _shown_time(report.started, simulated=simulated),
        report.outcome.value,
        report.revision_after,
        seconds(report.duration),
        report.request.actor,
        report.request.reason,
    )


def _show_entry(report: AdaptationReport) -> None:
    say(managing.headline(report))
    why = " ".join(report.request.reason.split()) or "no reason given"
    say(f"by {report.request.actor or 'unknown'}, because: {why}")
    for line in managing.change_lines(report.request):
        say(f"  {line}")
    for name, value in report.request.context.items():
        say(f"  {name}: {json.dumps(value, default=str) if isinstance(value, dict | list) else value}")
    for phase in report.phases:
        say(f"  {phase.phase.value} took {seconds(phase.duration)}")
    for violation in report.violations:
        say(f"  violation: {violation_line(violation)}")
    for step in report.steps:
        say(f"  {managing.step_line(step)}")
    for line in managing.unreached_lines(report):
        say(f"  {line}")
