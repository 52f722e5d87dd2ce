"""``regraft swap`` and ``move``: another class, or another host, for a component that continues meanwhile."""

from __future__ import annotations

from typing import Annotated

import typer

from regraft.bus_schema.keys import component_name
from regraft.bus_schema.model.adaptation import Change, Move, Swap
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.watched import Confirmation
from regraft.cli.running_system import reached
from regraft.cli.terminal.options import (
    ComponentArgument,
    ConfirmOption,
    DryRunOption,
    JsonOption,
    ReasonOption,
    SystemOption,
    WatchOption,
)
from regraft.cli.terminal.values import assignments

Several = list[str] | None


def swap(
    ctx: typer.Context,
    component: ComponentArgument,
    cls: Annotated[
        str, typer.Argument(metavar="[CLASS]", help="module:Class; by default the present class, configured otherwise.")
    ] = "",
    parameters: Annotated[
        Several, typer.Option("--set", "-p", metavar="NAME=VALUE", help="A parameter; the others keep their values.")
    ] = None,
    ports: Annotated[
        Several, typer.Option("--connect", metavar="PORT=TOPIC", help="The topic of a port, null for none.")
    ] = None,
    host: Annotated[str, typer.Option("--host", metavar="HOST", help="The host where it continues.")] = "",
    without_state: Annotated[bool, typer.Option("--without-state", help="Start without the present state.")] = False,
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    confirm: ConfirmOption = None,
    watch: WatchOption = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have another class continue in a component's place, or the same one configured otherwise; nothing is missed."""
    topics = assignments(ports or (), "--connect ")
    connections = {port: None if topic is None else str(topic) for port, topic in topics.items()}
    values = assignments(parameters or (), "--set ")
    name = component_name(component)
    changes: tuple[Change, ...] = (Swap(name, cls, values, connections, with_state=not without_state),)
    if host:
        changes += (Move(name, host),)
    confirmation = Confirmation.typed(confirm, watch)
    with reached(ctx, system) as there:
        managing.change(there, *changes, reason=reason, dry_run=dry_run, as_json=as_json, confirmation=confirmation)


def move(
    ctx: typer.Context,
    component: ComponentArgument,
    host: Annotated[str, typer.Argument(metavar="HOST", help="The host where it continues.")],
    without_state: Annotated[bool, typer.Option("--without-state", help="Start without the present state.")] = False,
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    confirm: ConfirmOption = None,
    watch: WatchOption = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have a component continue at another host, with its state; nothing is missed."""
    change = Move(component_name(component), host, with_state=not without_state)
    confirmation = Confirmation.typed(confirm, watch)
    with reached(ctx, system) as there:
        managing.change(there, change, reason=reason, dry_run=dry_run, as_json=as_json, confirmation=confirmation)
