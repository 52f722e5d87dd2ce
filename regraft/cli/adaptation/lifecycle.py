"""``regraft lifecycle``: states of components."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from regraft.bus_schema.messages.protocol.control import ComponentView, SetTransition
from regraft.bus_schema.model.adaptation import ChangeState
from regraft.bus_schema.model.lifecycle import Transition, legal
from regraft.cli.adaptation import managing
from regraft.cli.running_system import Reached, no_process, reached
from regraft.cli.terminal.one_of import one_of
from regraft.cli.terminal.options import (
    ComponentArgument,
    DryRunOption,
    JsonOption,
    ReasonOption,
    RobotOption,
    SystemOption,
)
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.client import ClientError, NoSuchComponent

lifecycle = typer.Typer(help="Get and change the states of components.", no_args_is_help=True, rich_markup_mode=None)

OptionalComponent = Annotated[str | None, typer.Argument(metavar="[COMPONENT]", help="Only this component.")]


@lifecycle.command("list")
def list_states(
    ctx: typer.Context,
    component: OptionalComponent = None,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List components with their states and the transitions that these allow."""
    with reached(ctx, system) as there:
        known = there.known.of_robot(robot)
        # Reports of hosts need not have come yet: the names are those that the first host has been given.
        managed = [name for name, spec in known.components.items() if spec.managed]
        silent = [name for name in known.silent if known.view.has_component(name)]
        names = [known.component(component).name] if component else sorted({*managed, *silent})
        rows = [_row(there, name) for name in names]
    if as_json:
        show_json({"components": rows})
        return
    cells = ((row["component"], row["state"], ", ".join(row["transitions"])) for row in rows)
    show_table(("component", "state", "transitions"), cells, empty="no components")
    for error in (row["error"] for row in rows if row["error"]):
        complain(error)


def _row(there: Reached, component: str) -> dict[str, Any]:
    state, error = None, ""
    try:
        state = there.client.view(component).state
    except NoSuchComponent:
        error = no_process(component)
    except ClientError as failed:
        error = str(failed)
    allowed = [transition.value for transition in legal(state)] if state else []
    return {"component": component, "state": state.value if state else None, "transitions": allowed, "error": error}


@lifecycle.command("get")
def get(
    ctx: typer.Context, component: ComponentArgument, system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """Print a component's state."""
    with reached(ctx, system) as there, there.needing(component):
        state = there.client.view(component).state.value
    if as_json:
        show_json({"component": component, "state": state})
    else:
        say(state)


@lifecycle.command("set")
def set_state(
    ctx: typer.Context,
    component: ComponentArgument,
    transition: Annotated[
        Transition,
        typer.Argument(metavar="TRANSITION", help="The task of the planner.", parser=one_of(Transition, "transition")),
    ],
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have a component configure, activate, deactivate or cleanup; one without an adaptation manager shutdown too."""
    with reached(ctx, system) as there:
        there.known.component(component)
        if component in there.known.hosted:
            change = ChangeState(component, transition)
            managing.change(there, change, reason=reason, dry_run=dry_run, as_json=as_json)
            return
        managing.refuse_dry_run(component, dry_run)
        with there.needing(component):
            view = there.client.control(component, "transition", SetTransition(transition))
    assert isinstance(view, ComponentView)
    if as_json:
        show_json({"component": component, "state": view.state.value})
    else:
        say(f"{component} is {view.state.value}")
