"""Changing a system: through its adaptation manager, or directly where a component runs alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import TypeVar

import typer

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.planning import Proposal
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    AdaptationReport,
    AdaptationRequest,
    Change,
    Outcome,
    StepReport,
)
from regraft.bus_schema.model.qualities.estimates import Estimate
from regraft.cli.adaptation.mistakes import NO_FILE, is_of_watch, refuse_mistakes, violation_line
from regraft.cli.adaptation.watched import Confirmation
from regraft.cli.outcomes import BAD_INPUT, FAILED, BadInput, Unreachable
from regraft.cli.running_system import Reached, user
from regraft.cli.terminal.output import complain, say, seconds, show_json
from regraft.component.errors import CallFailed
from regraft.stack.yaml.nodes import Location

A = TypeVar("A")

ADAPTATION_TIMEOUT = 60.0
UNWATCHED = Confirmation()
GOOD = (Outcome.APPLIED, Outcome.APPLIED_STATE_LOST, Outcome.PENDING, Outcome.CONFIRMING)


def require_manager(there: Reached) -> None:
    """Raise Unreachable if the system has no adaptation manager."""
    if ADAPT not in there.known.offers():
        raise Unreachable(
            "this system has no adaptation manager, which carries out adaptations and keeps their journal: add a "
            "component of the class regraft.adaptation_manager.manager:AdaptationManager to its stack"
        )


def ask(there: Reached, service: str, request: object, reply: type[A], timeout: float = 5.0) -> A:
    """Ask the adaptation manager; raises CallFailed, Unreachable."""
    require_manager(there)
    return there.client.call(service, request, reply, timeout)


def adapt(
    there: Reached,
    request: AdaptationRequest,
    timeout: float = ADAPTATION_TIMEOUT,
    locations: Mapping[str, Location] = NO_FILE,
) -> AdaptationReport:
    """Have an adaptation carried out, and confirmed if it is to be.

    ``locations`` are those of the request's fields in its file.

    Raises:
        BadInput: it names what is not there, or has a value that does not fit; nobody has been asked.
        CallFailed, Unreachable: the adaptation manager refuses, or is not there.
    """
    require_manager(there)
    refuse_mistakes(there, request, locations)
    with unanswered(there, may_happen=not request.dry_run):
        return there.client.call(ADAPT, request, AdaptationReport, timeout + request.confirm, patient=True)


@contextmanager
def unanswered(there: Reached, *, may_happen: bool = True) -> Iterator[None]:
    """Have a request without an answer name where its adaptation is found: it may be carried out later."""
    try:
        yield
    except CallFailed as error:
        if error.answer is not None or not may_happen:
            raise
        there.check()
        why = f"{error.why}; what was asked for may still happen: see 'regraft journal'"
        raise CallFailed(error.service, None, why) from None


def change(
    there: Reached,
    *changes: Change,
    reason: str,
    dry_run: bool,
    as_json: bool,
    confirmation: Confirmation = UNWATCHED,
) -> None:
    """Have changes carried out, or only tried, and show what became of them; raises as ``adapt`` does."""
    request = AdaptationRequest(
        changes, reason, user(), dry_run=dry_run, confirm=confirmation.confirm, watch=confirmation.watch
    )
    show_report(adapt(there, request), as_json=as_json)


def refuse_dry_run(component: str, dry_run: bool) -> None:
    """Raise BadInput if a change is only to be tried that no adaptation manager carries out."""
    if dry_run:
        raise BadInput(f"{component} takes changes directly: only an adaptation manager can try them by --dry-run")


def show_report(
    report: AdaptationReport,
    *,
    as_json: bool,
    good: Collection[Outcome] = GOOD,
    locations: Mapping[str, Location] = NO_FILE,
) -> None:
    """Print what became of an adaptation, and exit with 1 if that is nothing ``good``.

    It is 2 if there is nothing wrong but with the conditions to watch: then a mistake was typed.
    ``locations`` are those of the request's fields in its file.
    """
    if as_json:
        show_json(report)
    else:
        say(headline(report))
        for violation in report.violations:
            complain(violation_line(violation, locations))
        if report.request.dry_run or report.outcome not in good:
            for step in report.steps:
                say(f"  {step_line(step)}")
        for line in unreached_lines(report):
            say(f"  {line}")
        for line in estimate_lines(report.estimate):
            say(f"  {line}")
    if report.outcome not in good:
        mistyped = report.violations and all(is_of_watch(violation) for violation in report.violations)
        raise typer.Exit(BAD_INPUT if mistyped else FAILED)


def unreached_lines(report: AdaptationReport) -> list[str]:
    """Return each component that an adaptation is about and did not reach, as one line."""
    return [f"not reached: {each.component}: {each.why}" for each in report.unreached]


def estimate_lines(estimate: Estimate | None) -> list[str]:
    """Return what an adaptation would take and give, as lines."""
    if estimate is None:
        return []
    past = sum(step.samples > 0 for step in estimate.steps)
    basis = f"known from the past for {past} of {len(estimate.steps)} steps" if estimate.steps else "nothing to do"
    lines = [f"expected to take {seconds(estimate.median)}, seldom more than {seconds(estimate.p95)} ({basis})"]
    for quality in estimate.qualities:
        if quality.before == quality.after and not quality.after_why:
            continue
        before, after = ("unknown" if v is None else f"{v:.4g}" for v in (quality.before, quality.after))
        why = f": {quality.after_why}" if quality.after_why else ""
        source = f"{quality.before_source.value} -> {quality.after_source.value}"
        lines.append(f"{quality.component}.{quality.quality}: {before} -> {after} ({source}{why})")
    return lines


def change_lines(request: AdaptationRequest | Proposal) -> list[str]:
    """Return each change as one line."""
    return [
        f"{change.pop('change')}: {', '.join(f'{name} {_shown(value)}' for name, value in change.items())}"
        for change in codec.to_plain(request)["changes"]
    ]


def _shown(value: object) -> object:
    return "null" if value is None else value


def headline(report: AdaptationReport) -> str:
    """Return an adaptation's outcome as one line."""
    what = "dry run, " if report.request.dry_run else f"adaptation {report.id} " if report.id else ""
    parts = [f"{what}{report.outcome.value.replace('_', ' ')}"]
    if report.revision_after != report.revision_before:
        parts.append(f"revision {report.revision_before} to {report.revision_after}")
    if report.duration:
        parts.append(f"in {seconds(report.duration)}")
    return ", ".join(parts) + (f": {report.error}" if report.error else "")


def step_line(step: StepReport) -> str:
    """Return a step as one line."""
    error = f": {step.error}" if step.error else ""
    took = f" in {seconds(step.duration)}" if step.duration else ""
    return f"{step.number}. {step.component}: {step.action}: {step.state.value.replace('_', ' ')}{took}{error}"
