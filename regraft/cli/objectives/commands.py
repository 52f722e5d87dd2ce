"""``regraft objective``: what a metacontroller is to provide, and what becomes of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from regraft.bus_schema.messages.management.objectives import (
    ADD,
    CANCEL,
    CONTEXT,
    EXPLAIN,
    LIST,
    REPORT,
    ContextRequest,
    ContextStatus,
    Explanation,
    ExplanationQuery,
    Objective,
    ObjectivesCancellation,
    ObjectivesQuery,
    ObjectivesRequest,
    ObjectivesStatus,
    ObjectiveStatus,
    ProgressReport,
)
from regraft.cli.objectives.asking import ask, planner_meant
from regraft.cli.objectives.showing import has_ended, show_details, show_list
from regraft.cli.objectives.typed import Wanted, bounds, curves, objectives_in, weights
from regraft.cli.outcomes import FAILED, BadInput
from regraft.cli.running_system import reached, user
from regraft.cli.terminal.negative_values import TakesValues
from regraft.cli.terminal.numbers import number
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption, TimeoutOption
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.cli.terminal.values import assignments, value_of
from regraft.component.errors import CallFailed

objective = typer.Typer(
    help="Have a metacontroller provide skills with the qualities that they need.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

PROVIDED_TIMEOUT = 60.0
"""Seconds for realizations to be entered, or to be left for rest."""
MAX_PRIORITY = 1e6
PlannerOption = Annotated[
    str, typer.Option("--planner", metavar="NAME", help="The metacontroller; needed only if there are several.")
]
ObjectiveArgument = Annotated[str, typer.Argument(metavar="OBJECTIVE", help="An objective's name.")]
NoWaitOption = Annotated[bool, typer.Option("--no-wait", help="Return before it is done.")]
Repeated = list[str] | None


@objective.command("add")
def add(
    ctx: typer.Context,
    skill: Annotated[str, typer.Argument(metavar="[SKILL]", help="The skill that is to be provided.")] = "",
    requirements: Annotated[
        Repeated,
        typer.Argument(metavar="[QUALITY=NUMBER...]", help="Bounds, also 'safety>=0.5' and 'energy<=0.4' in quotes."),
    ] = None,
    file: Annotated[
        str, typer.Option("--file", metavar="FILE", help="Objectives in YAML or JSON in place of SKILL; - for input.")
    ] = "",
    name: Annotated[str, typer.Option("--name", metavar="NAME", help="Its name; by default the skill's.")] = "",
    priority: Annotated[
        float,
        typer.Option(
            "--priority",
            metavar="NUMBER",
            parser=number(-MAX_PRIORITY, MAX_PRIORITY),
            help="A higher one is decided first.",
        ),
    ] = 0.0,
    always_improve: Annotated[
        bool, typer.Option("--always-improve", help="Change for a better realization, also without an error.")
    ] = False,
    realization: Annotated[
        str, typer.Option("--realization", metavar="NAME", help="The realization to begin with.")
    ] = "",
    weight: Annotated[
        Repeated, typer.Option("--weight", metavar="QUALITY=NUMBER", help="Its share of the utility; may be repeated.")
    ] = None,
    curve: Annotated[
        Repeated,
        typer.Option(
            "--curve",
            metavar="QUALITY=VALUE:UTILITY,...",
            help="The utility of its values, linear between points; may be repeated.",
        ),
    ] = None,
    inputs: Annotated[
        Repeated, typer.Option("--input", metavar="NAME=VALUE", help="An input of the skill; may be repeated.")
    ] = None,
    task: Annotated[str, typer.Option("--task", metavar="NAME", help="The task that it is for.")] = "",
    no_wait: NoWaitOption = False,
    planner: PlannerOption = "",
    robot: RobotOption = "",
    timeout: TimeoutOption = PROVIDED_TIMEOUT,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have a skill provided, with bounds for its qualities; or all objectives of a file, or none."""
    described = Objective(
        skill,
        name,
        {},
        priority,
        always_improve,
        weights(weight),
        curves(curve),
        realization,
        assignments(inputs or (), "--input "),
        task,
    )
    wanted = _wanted(described, requirements or (), file)
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        request = ObjectivesRequest(wanted.objectives, user(), not no_wait)
        try:
            found = ask(there, meant, ADD, request, ObjectivesStatus, timeout)
        except CallFailed as error:
            raise wanted.at_fault(error) from None
    if as_json:
        show_json(found)
    else:
        show_list(found)
    names = {each.name or each.skill for each in wanted.objectives}
    missing = [each for each in found.objectives if each.objective in names and not each.realization]
    if missing and not no_wait:
        for each in missing:
            why = "; ".join(each.reasons) or "no reason given"
            complain(f"{each.objective} is accepted, and nothing provides it now: {why}")
        raise typer.Exit(FAILED)


def _wanted(described: Objective, requirements: list[str] | tuple[str, ...], file: str) -> Wanted:
    """Return what is asked for, in the file or as it was typed; raises BadInput."""
    if file:
        if requirements or described != Objective(""):
            raise BadInput("--file has all of the objectives: leave SKILL, QUALITY and the options of objectives out")
        return objectives_in(file)
    if not described.skill:
        raise BadInput("name a SKILL, or a --file with objectives")
    return Wanted((_with_bounds(described, requirements),))


def _with_bounds(described: Objective, requirements: list[str] | tuple[str, ...]) -> Objective:
    typed = bounds(requirements)
    return replace(
        described,
        requirements={name: bound.number for name, bound in typed.items()},
        operators={name: bound.comparison for name, bound in typed.items() if bound.comparison is not None},
    )


@objective.command("list")
def list_objectives(
    ctx: typer.Context,
    planner: PlannerOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List objectives, and what provides them."""
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        found = ask(there, meant, LIST, ObjectivesQuery(), ObjectivesStatus)
    if as_json:
        show_json(found)
    else:
        show_list(found)


@objective.command("show")
def show(
    ctx: typer.Context,
    name: ObjectiveArgument,
    planner: PlannerOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show an objective: its state, its realization, its qualities, and what went wrong."""
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        found = ask(there, meant, LIST, ObjectivesQuery(name), ObjectivesStatus)
    if as_json:
        show_json(found)
    else:
        show_details(found)


@objective.command("explain")
def explain(
    ctx: typer.Context,
    name: ObjectiveArgument,
    planner: PlannerOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the reasons for and against each realization in the latest decision."""
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        found = ask(there, meant, EXPLAIN, ExplanationQuery(name), Explanation)
    if as_json:
        show_json(found)
    else:
        say(found.text)


@objective.command("cancel")
def cancel(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="[OBJECTIVE]", help="An objective's name.")] = "",
    task: Annotated[str, typer.Option("--task", metavar="NAME", help="All objectives of this task.")] = "",
    no_wait: NoWaitOption = False,
    planner: PlannerOption = "",
    robot: RobotOption = "",
    timeout: TimeoutOption = PROVIDED_TIMEOUT,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """End an objective, or all of a task: their components come to rest. With --json, show those that are left."""
    if bool(name) == bool(task):
        raise BadInput("name either an OBJECTIVE or a --task")
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        request = ObjectivesCancellation(name, task, user(), not no_wait)
        found = ask(there, meant, CANCEL, request, ObjectivesStatus, timeout)
    if as_json:
        show_json(found)
    elif no_wait:
        say(f"{name or f'the task {task}'} is being cancelled")
    else:
        say(f"{name or f'the task {task}'} is cancelled")


@objective.command("context")
def context(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="[CONTEXT]", help="The context to set; none: show it.")] = "",
    planner: PlannerOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the contexts in which realizations are chosen, or set the present one."""
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        if name:
            changed = ask(there, meant, CONTEXT, ContextRequest(name, user()), ContextStatus)
            if as_json:
                show_json(changed)
            else:
                say(f"the context is {changed.context}; it was {changed.before}")
            return
        found = ask(there, meant, LIST, ObjectivesQuery(), ObjectivesStatus)
    if as_json:
        show_json({"context": found.context, "contexts": list(found.contexts)})
        return
    rows = [(each, "yes" if each == found.context else "") for each in sorted({found.context, *found.contexts})]
    show_table(("context", "present"), rows, empty="no contexts")


@objective.command("report", cls=TakesValues)
def report(
    ctx: typer.Context,
    name: ObjectiveArgument,
    result: Annotated[str, typer.Argument(metavar="RESULT", help="The skill's result: a text or a number.")],
    planner: PlannerOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Report a skill's result, which its results classify: success and error end the objective."""
    value = value_of(result, "RESULT")
    if isinstance(value, int | float) and not isinstance(value, bool):
        request = ProgressReport(name, number=float(value))
    else:
        request = ProgressReport(name, value if isinstance(value, str) else result)
    with reached(ctx, system) as there:
        meant = planner_meant(there, planner, robot)
        found = ask(there, meant, REPORT, request, ObjectiveStatus)
    if as_json:
        show_json(found)
    else:
        say(f"{found.objective}: {found.progress.value}{', ended' if has_ended(found) else ''}")
