"""``regraft mission break`` and its kin: breakpoints of a running mission."""

from __future__ import annotations

from typing import Annotated

import typer

from regraft.bus_schema.messages.mission import (
    BreakpointChange,
    BreakpointsRequest,
    Command,
    ForcedResult,
    MissionBreakpoints,
    MissionCommand,
    TickPosition,
)
from regraft.bus_schema.model.robots.executors import BREAKPOINTS
from regraft.cli.running_system import reached
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption
from regraft.cli.terminal.output import show_json, show_table
from regraft.services.bt_executor.authors.commanding import executor_in, give_command

NODE_HELP = "Path, a name that it alone has, or uid."
AfterOption = Annotated[bool, typer.Option("--after", help="After the node has run, not before.")]
ResultOption = Annotated[
    ForcedResult | None, typer.Option("--result", help="Force this result on the node at which the tick has stopped.")
]


def set_breakpoint(
    ctx: typer.Context,
    node: Annotated[str, typer.Argument(metavar="NODE", help=NODE_HELP)],
    after: AfterOption = False,
    result: Annotated[
        ForcedResult | None, typer.Option("--result", help="Force this result there, and do not stop.")
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="Only the first time.")] = False,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Stop the mission before a node, in the middle of a tick."""
    request = BreakpointsRequest(BreakpointChange.SET, node, _position(after), result, once)
    _ask(ctx, robot, system, request, as_json)


def list_breakpoints(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """Show the breakpoints."""
    _ask(ctx, robot, system, BreakpointsRequest(), as_json)


def clear_breakpoints(
    ctx: typer.Context,
    node: Annotated[str, typer.Argument(metavar="[NODE]", help=f"{NODE_HELP} All by default.")] = "",
    after: AfterOption = False,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Remove the breakpoint at a node, or all of them."""
    change = BreakpointChange.REMOVE if node else BreakpointChange.CLEAR
    _ask(ctx, robot, system, BreakpointsRequest(change, node, _position(after)), as_json)


def resume(
    ctx: typer.Context,
    result: ResultOption = None,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Continue a tick that has stopped at a breakpoint."""
    give_command(ctx, robot, system, MissionCommand(Command.CONTINUE, result=result), as_json)


def go_to_next(
    ctx: typer.Context,
    result: ResultOption = None,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Continue to the next node that runs, and stop before it."""
    give_command(ctx, robot, system, MissionCommand(Command.NEXT, result=result), as_json)


def _position(after: bool) -> TickPosition:
    return TickPosition.AFTER if after else TickPosition.BEFORE


def _ask(ctx: typer.Context, robot: str, system: str | None, request: BreakpointsRequest, as_json: bool) -> None:
    with reached(ctx, system) as there:
        found = there.client.call(executor_in(there, robot).service(BREAKPOINTS), request, MissionBreakpoints)
    if as_json:
        show_json(found)
        return
    rows = []
    for each in found.breakpoints:
        result = each.result.value if each.result else ""
        rows.append((each.uid, each.node, each.position.value, result, "once" if each.once else ""))
    show_table(("uid", "node", "position", "result", ""), rows, empty="no breakpoints")
