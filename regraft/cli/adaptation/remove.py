"""``regraft remove``: ends a component, its process included."""

from __future__ import annotations

from typing import Annotated

import typer

from regraft.bus_schema.keys import component_name
from regraft.bus_schema.model.adaptation import Remove
from regraft.cli.adaptation import managing
from regraft.cli.running_system import reached
from regraft.cli.terminal.options import ComponentArgument, DryRunOption, JsonOption, ReasonOption, SystemOption


def remove(
    ctx: typer.Context,
    component: ComponentArgument,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topic", metavar="TOPIC", help="A topic that goes with it; may be given several times."),
    ] = None,
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """End a component of a running stack, its process included; 'regraft undo' brings it back."""
    component_name(component)
    with reached(ctx, system) as there:
        managing.change(there, Remove(component, tuple(topics or ())), reason=reason, dry_run=dry_run, as_json=as_json)
