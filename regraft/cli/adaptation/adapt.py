"""``regraft adapt``, ``undo`` and ``journal``: changing a system, and what has been changed."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.manager import (
    CancelAdaptation,
    ConfirmAdaptation,
    UndoAdaptation,
)
from regraft.bus_schema.model.adaptation import (
    CANCEL,
    CONFIRM,
    UNDO,
    AdaptationReport,
    AdaptationRequest,
    Outcome,
)
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.watched import Confirmation, conditions
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import reached, user
from regraft.cli.terminal.options import (
    ConfirmOption,
    DryRunOption,
    JsonOption,
    ReasonOption,
    RevisionOption,
    SystemOption,
    TimeoutOption,
    WatchOption,
)
from regraft.cli.terminal.values import line_of, read_located
from regraft.stack.yaml.nodes import Location, locations_of, plain


def adapt(
    ctx: typer.Context,
    file: Annotated[
        str,
        typer.Argument(metavar="FILE", help="An adaptation request in YAML or JSON; - for standard input."),
    ],
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    revision: RevisionOption = None,
    confirm: ConfirmOption = None,
    watch: WatchOption = None,
    timeout: TimeoutOption = managing.ADAPTATION_TIMEOUT,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Carry out an adaptation: all of its changes, or none."""
    request, locations = request_of(file)
    request = replace(
        request,
        dry_run=dry_run or request.dry_run,
        reason=reason or request.reason,
        actor=request.actor or user(),
        revision=revision if revision is not None else request.revision,
        confirm=confirm if confirm is not None else request.confirm,
        watch=(*request.watch, *conditions(watch or ())),
    )
    with reached(ctx, system) as there:
        report = managing.adapt(there, request, timeout, locations)
        managing.show_report(report, as_json=as_json, locations=locations)


def request_of(file: str) -> tuple[AdaptationRequest, dict[str, Location]]:
    """Return the adaptation request in a file, and where each of its fields is; raises BadInput."""
    node = read_located(file)
    locations = locations_of(node)
    try:
        return codec.from_plain(plain(node), AdaptationRequest), locations
    except BadMessage as error:
        raise BadInput(f"{line_of(error.where, locations) or file}: {error}") from None


def undo(
    ctx: typer.Context,
    adaptation: Annotated[str, typer.Argument(metavar="ID", help="The adaptation's id in the journal.")],
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    revision: RevisionOption = None,
    confirm: ConfirmOption = None,
    watch: WatchOption = None,
    timeout: TimeoutOption = managing.ADAPTATION_TIMEOUT,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Undo an applied adaptation by a new one."""
    wanted = Confirmation.typed(confirm, watch)
    with reached(ctx, system) as there:
        request = UndoAdaptation(adaptation, user(), reason, dry_run, wanted.confirm, wanted.watch, revision)
        with managing.unanswered(there, may_happen=not dry_run):
            report = managing.ask(there, UNDO, request, AdaptationReport, timeout + request.confirm)
        managing.show_report(report, as_json=as_json)


def confirm(
    ctx: typer.Context,
    adaptation: Annotated[str, typer.Argument(metavar="ID", help="The adaptation's id in the journal.")],
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make an adaptation that is being confirmed final at once."""
    _decide(ctx, CONFIRM, ConfirmAdaptation(adaptation), system, as_json=as_json)


def cancel(
    ctx: typer.Context,
    adaptation: Annotated[str, typer.Argument(metavar="ID", help="The adaptation's id in the journal.")],
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Cancel an adaptation that waits, is under way or is being confirmed: what it did is undone."""
    _decide(ctx, CANCEL, CancelAdaptation(adaptation), system, as_json=as_json)


def _decide(ctx: typer.Context, service: str, request: object, system: str | None, *, as_json: bool) -> None:
    with reached(ctx, system) as there:
        with managing.unanswered(there):
            report = managing.ask(there, service, request, AdaptationReport, managing.ADAPTATION_TIMEOUT)
        wanted = (Outcome.CANCELLED,) if service == CANCEL else managing.GOOD
        managing.show_report(report, as_json=as_json, good=wanted)
