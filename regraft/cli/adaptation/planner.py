"""``regraft planner``: who decides on adaptations, and what they would decide."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated

import typer

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.robots.planners import DESCRIBE, PROPOSE, planner_service, planners_with
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.mistakes import violation_line
from regraft.cli.outcomes import FAILED, BadInput
from regraft.cli.running_system import Reached, reached, user
from regraft.cli.terminal.options import JsonOption, ReasonOption, RobotOption, SystemOption, TimeoutOption
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.cli.terminal.values import read_document
from regraft.cli.topology import Topology, named
from regraft.component.errors import CallFailed

planner = typer.Typer(help="List planners, and ask them for proposals.", no_args_is_help=True, rich_markup_mode=None)


@planner.command("list")
def list_planners(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """List planners, with their strategies and the knobs of each."""
    with reached(ctx, system) as there:
        planners = _planners(there.known.of_robot(robot))
        found = [_described(there, name, component) for name, component in sorted(planners.items())]
    if as_json:
        show_json({"planners": [{**codec.to_plain(described), "error": error} for described, error in found]})
        return
    rows = [
        (described.planner, described.component, strategy.name, _knobs(strategy.knobs))
        for described, _ in found
        for strategy in described.strategies
    ]
    rows += [(described.planner, described.component, "", "") for described, _ in found if not described.strategies]
    show_table(("planner", "component", "strategy", "knobs"), rows, empty="no planners")
    for error in (error for _, error in found if error):
        complain(error)


@planner.command("propose")
def propose(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="PLANNER")],
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A proposal's request in YAML or JSON; - for standard input.")
    ],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the choice, change nothing; a credit counts.")
    ] = False,
    reason: ReasonOption = "",
    timeout: TimeoutOption = managing.ADAPTATION_TIMEOUT,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have a planner decide, and what it decides carried out."""
    try:
        request = codec.from_plain(read_document(file), ProposalRequest)
    except BadMessage as error:
        raise BadInput(f"{file}: {error}") from None
    request = replace(
        request,
        apply=request.apply and not dry_run,
        reason=reason or request.reason,
        actor=request.actor or user(),
    )
    with reached(ctx, system) as there:
        named("planner", name, _planners(there.known))
        with managing.unanswered(there, may_happen=request.apply):
            found = there.client.call(planner_service(name, PROPOSE), request, Proposal, timeout)
    if as_json:
        show_json(found)
    else:
        _show(found)
    if found.report is not None and found.report.outcome not in managing.GOOD:
        raise typer.Exit(FAILED)


def _show(found: Proposal) -> None:
    for field, value in found.choice.items():
        say(f"{field}: {json.dumps(value) if isinstance(value, dict | list) else value}")
    for line in managing.change_lines(found):
        say(f"  {line}")
    if found.ticket:
        say(f"ticket: {found.ticket}")
    if found.report is not None:
        say(managing.headline(found.report))
        for violation in found.report.violations:
            complain(violation_line(violation))


def _planners(known: Topology) -> dict[str, str]:
    """Return the components that are planners, by the names of the planners."""
    return planners_with(PROPOSE, known.components)


def _described(there: Reached, name: str, component: str) -> tuple[PlannerDescription, str]:
    """Return what a planner is, and why no more than its name is known, empty if it has answered."""
    try:
        return there.client.call(planner_service(name, DESCRIBE), PlannerQuery(), PlannerDescription), ""
    except CallFailed as error:
        return PlannerDescription(name, component), str(error)


def _knobs(schema: dict[str, PlainValue]) -> str:
    return ", ".join(f"{name}={described.get('default')}" for name, described in schema.get("properties", {}).items())
