"""``regraft mission``: what the mission executor does, and commands to it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bus_schema.messages.mission import Command, MissionCommand, MissionNode, MissionRequest, MissionStatus
from regraft.cli.group import BadInput, Unreachable
from regraft.cli.options import JsonOption, SystemOption
from regraft.cli.output import say, show_json
from regraft.cli.reach import Reached, reached
from regraft.cli.topology import topology

mission = typer.Typer(help="See and command the mission.", no_args_is_help=True, rich_markup_mode=None)

STATUS, COMMAND = "mission/status", "mission/command"
MARKS = {"idle": " ", "running": ">", "success": "+", "failure": "!", "skipped": "-"}
LARGEST_TREE = 1_000_000


@mission.command("status")
def status(ctx: typer.Context, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Show the behaviour tree with the status of every node, and the blackboard."""
    with reached(ctx, system) as there:
        _require_executor(there)
        found = there.client.call(STATUS, MissionRequest(), MissionStatus)
    if as_json:
        show_json(found)
        return
    say(headline(found))
    for line in tree_lines(found.nodes):
        say(line)
    for name, value in sorted(found.blackboard.items()):
        say(f"  {name} = {value}")


@mission.command("start")
def start(ctx: typer.Context, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Start the loaded tree, or go on after a pause."""
    _command(ctx, system, MissionCommand(Command.START), as_json)


@mission.command("pause")
def pause(ctx: typer.Context, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Tick the tree no more until it is started again."""
    _command(ctx, system, MissionCommand(Command.PAUSE), as_json)


@mission.command("step")
def step(ctx: typer.Context, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Tick the paused tree once."""
    _command(ctx, system, MissionCommand(Command.STEP), as_json)


@mission.command("halt")
def halt(ctx: typer.Context, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Halt the tree; its goals are cancelled."""
    _command(ctx, system, MissionCommand(Command.HALT), as_json)


@mission.command("load")
def load(
    ctx: typer.Context,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="BehaviorTree.CPP XML.")],
    main: Annotated[str, typer.Option("--main", metavar="ID", help="The tree to run, if the file has several.")] = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Load a tree in place of the present one."""
    _command(ctx, system, MissionCommand(Command.LOAD, _text(file), main), as_json)


def _text(file: Path) -> str:
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{file}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadInput(f"{file}: is not UTF-8 text") from None
    if len(text) > LARGEST_TREE:
        raise BadInput(f"{file}: is too large for a tree: must have at most {LARGEST_TREE} characters")
    return text


def _command(ctx: typer.Context, system: str | None, command: MissionCommand, as_json: bool) -> None:
    with reached(ctx, system) as there:
        _require_executor(there)
        found = there.client.call(COMMAND, command, MissionStatus)
    if as_json:
        show_json(found)
    else:
        say(headline(found))


def _require_executor(there: Reached) -> None:
    if STATUS not in topology(there).offers("service"):
        raise Unreachable(f"this system has no mission executor: nobody offers the service {STATUS}")


def headline(found: MissionStatus) -> str:
    """Return a mission's state as one line."""
    tree = f" {found.tree}" if found.tree else ""
    running = f", at {found.running[-1]}" if found.running else ""
    error = f": {found.error}" if found.error else ""
    return f"mission{tree} {found.state.value}, {found.ticks} ticks{running}{error}"


def tree_lines(nodes: tuple[MissionNode, ...]) -> list[str]:
    """Return a tree as indented lines, each led by a mark for the node's status."""
    depth: dict[int, int] = {}
    lines = []
    for node in nodes:
        depth[node.uid] = depth.get(node.parent, -1) + 1
        name = node.name if node.name == node.type else f"{node.name} ({node.type})"
        lines.append(f"{MARKS[node.status.value]} {'  ' * depth[node.uid]}{name}  {node.status.value}")
    return lines
