"""Commands to the mission executor of a running system, and the mission as one line."""

from __future__ import annotations

import typer

from regraft.bus_schema.messages.mission import MissionCommand, MissionStatus
from regraft.bus_schema.model.robots.executors import (
    COMMAND,
    STATUS,
    MissionExecutor,
    NoSuchExecutor,
    WhichExecutor,
    executor_of,
    executors,
)
from regraft.cli.outcomes import BadInput, Unreachable
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.output import say, show_json


def give_command(ctx: typer.Context, robot: str, system: str | None, command: MissionCommand, as_json: bool) -> None:
    """Give a command to a mission's executor, and show the mission then."""
    with reached(ctx, system) as there:
        executor = executor_in(there, robot)
        found = there.client.call(executor.service(COMMAND), command, MissionStatus)
    if as_json:
        show_json(found)
    else:
        say(headline(found))


def executor_in(there: Reached, robot: str) -> MissionExecutor:
    """Return the executor that is meant; raises BadInput, Unreachable."""
    try:
        found = executor_of(executors(there.known.components, there.known.scopes), robot)
    except NoSuchExecutor as error:
        raise BadInput(str(error)) from None
    except WhichExecutor as error:
        raise BadInput(f"{error} with --robot") from None
    if found is None:
        raise Unreachable(f"this system has no mission executor: nobody offers the service {STATUS}")
    return found


def headline(found: MissionStatus) -> str:
    """Return a mission's state as one line."""
    tree = f" {found.tree}" if found.tree else ""
    running = f", at {found.running[-1]}" if found.running else ""
    stop = f", stopped {found.stop.position.value} {found.stop.node}" if found.stop else ""
    error = f": {found.error}" if found.error else ""
    return f"mission{tree} {found.state.value}, {found.ticks} ticks{running}{stop}{error}"
