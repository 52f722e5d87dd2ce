"""``regraft connect`` and ``disconnect``: move a port to another topic, or to none."""

from __future__ import annotations

from typing import Annotated

import typer

from regraft.bus_schema.keys import topic_name
from regraft.bus_schema.messages.protocol.control import Rewire, RewireStep
from regraft.bus_schema.model.adaptation import Connect
from regraft.bus_schema.suggestions import instead_of
from regraft.cli.adaptation import managing
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.options import ComponentArgument, DryRunOption, JsonOption, ReasonOption, SystemOption
from regraft.cli.terminal.output import say, show_json


def connect(
    ctx: typer.Context,
    component: ComponentArgument,
    port: Annotated[str, typer.Argument(metavar="PORT", help="An input or output of it.")],
    topic: Annotated[str, typer.Argument(metavar="TOPIC", help="The topic that it moves to.")],
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Move a port to another topic while messages flow."""
    _connect(ctx, Connect(component, port, topic_name(topic)), dry_run, reason, system, as_json)


def disconnect(
    ctx: typer.Context,
    component: ComponentArgument,
    port: Annotated[str, typer.Argument(metavar="PORT", help="An input or output that need not be connected.")],
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Connect a port to no topic; an input first handles what has been published by then."""
    _connect(ctx, Connect(component, port, None), dry_run, reason, system, as_json)


def _connect(
    ctx: typer.Context, change: Connect, dry_run: bool, reason: str, system: str | None, as_json: bool
) -> None:
    component, port, topic = change.component, change.port, change.topic
    with reached(ctx, system) as there:
        described = there.known.component(component).description
        ports = {said.name for said in described.ports} if described else set()
        if port not in ports:
            raise BadInput(f"{component} has no port {port!r}; {instead_of(port, ports)}")
        if component in there.known.hosted:
            managing.change(there, change, reason=reason, dry_run=dry_run, as_json=as_json)
            return
        managing.refuse_dry_run(component, dry_run)
        with there.needing(component):
            before = there.client.view(component).connections.get(port)
            if before != topic:
                rewire(there, component, port, topic)
    if as_json:
        show_json({"component": component, "port": port, "topic": topic, "before": before})
    else:
        say(f"{component}.{port} is connected to {'no topic' if topic is None else topic}")


def rewire(there: Reached, component: str, port: str, topic: str | None) -> None:
    """Move a port of a component that takes control queries from anybody; raises ClientError.

    Without an adaptation manager, writers may put no markers. Messages on either topic around the switch may then be
    missed.
    """
    if topic is None:
        steps = [Rewire(RewireStep.DISCONNECT, port)]
    else:
        steps = [Rewire(step, port, topic) for step in (RewireStep.OPEN, RewireStep.SWITCH)]
    for step in steps:
        there.client.control(component, "connections", step)
