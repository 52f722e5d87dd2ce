"""``regraft mission``: what the mission executor does, commands to it, its blackboard, and checks of mission files."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from regraft import CallFailed
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BlackboardRequest,
    Command,
    MissionCommand,
    MissionCounts,
    MissionCountsRequest,
    MissionRequest,
    MissionStatus,
    WriteBlackboard,
)
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.robots.executors import (
    BLACKBOARD,
    COUNTS,
    STATUS,
    WRITE,
)
from regraft.cli.bus.param import values_of
from regraft.cli.outcomes import BAD_INPUT, BadInput, Failed
from regraft.cli.running_system import reached
from regraft.cli.terminal.negative_values import TakesValues
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption
from regraft.cli.terminal.output import complain, say, seconds, show_json, show_table
from regraft.services.bt_executor.authors import breakpoint_commands, converting, drawing, replaying, trying
from regraft.services.bt_executor.authors.commanding import executor_in, give_command, headline
from regraft.services.bt_executor.authors.file_text import mission_text
from regraft.services.bt_executor.authors.options import MainOption, NodesOption, StackOption, TreeFile, TreesOption
from regraft.services.bt_executor.authors.showing import show_counts, tree_lines

mission = typer.Typer(help="See, command, check and draw missions.", no_args_is_help=True, rich_markup_mode=None)


TreeFileOrNone = Annotated[
    Path | None, typer.Argument(metavar="[FILE]", help="BehaviorTree.CPP XML; without, --main names a known tree.")
]
CountsOption = Annotated[
    bool, typer.Option("--counts", help="Show the ticks and results of each node instead, if they are counted.")
]
ResetOption = Annotated[bool, typer.Option("--reset", help="With --counts: count from zero again afterwards.")]
BoardOption = Annotated[
    str, typer.Option("--board", metavar="PATH", help="The blackboard of the sub-tree with this path.")
]


@mission.command("show")
def show(
    ctx: typer.Context,
    counts: CountsOption = False,
    reset: ResetOption = False,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the behaviour tree with the status of every node, and the blackboard."""
    if reset and not counts:
        raise BadInput("--reset is of --counts")
    with reached(ctx, system) as there:
        executor = executor_in(there, robot)
        asked = MissionCountsRequest(reset)
        counted = there.client.call(executor.service(COUNTS), asked, MissionCounts) if counts else None
        found = there.client.call(executor.service(STATUS), MissionRequest(), MissionStatus)
    if counted is not None and counted.structure != found.structure:
        raise Failed("another tree has been loaded meanwhile: ask again")
    if as_json:
        show_json(found if counted is None else counted)
        return
    if counted is not None:
        say(headline(found))
        show_counts(found.nodes, counted)
        return
    say(headline(found))
    for line in tree_lines(found.nodes):
        say(line)
    for quality in found.qualities:
        say(f"  {quality_line(quality)}")
    for name, value in sorted(found.blackboard.items()):
        say(f"  {name} = {value}")


@mission.command("status", hidden=True)
def status(
    ctx: typer.Context,
    counts: CountsOption = False,
    reset: ResetOption = False,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the same as `show`."""
    show(ctx, counts, reset, robot, system, as_json)


@mission.command("load")
def load(
    ctx: typer.Context,
    file: TreeFileOrNone = None,
    main: MainOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Load a tree in place of the present one, from a file or by its ID."""
    _give_tree(ctx, robot, system, _with_tree(Command.LOAD, file, main), file, as_json)


@mission.command("start")
def start(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """Start the loaded tree, or continue after a pause."""
    give_command(ctx, robot, system, MissionCommand(Command.START), as_json)


@mission.command("pause")
def pause(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """Tick the tree no more until it is started again."""
    give_command(ctx, robot, system, MissionCommand(Command.PAUSE), as_json)


@mission.command("step")
def step(ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Tick the paused tree once."""
    give_command(ctx, robot, system, MissionCommand(Command.STEP), as_json)


@mission.command("halt")
def halt(ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Halt the tree; its goals are cancelled."""
    give_command(ctx, robot, system, MissionCommand(Command.HALT), as_json)


@mission.command("swap")
def swap(
    ctx: typer.Context,
    file: TreeFileOrNone = None,
    main: MainOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Have another tree take over from the running one at once; the root blackboard is carried over."""
    _give_tree(ctx, robot, system, _with_tree(Command.SWAP, file, main), file, as_json)


@mission.command("get")
def get(
    ctx: typer.Context,
    key: Annotated[str, typer.Argument(metavar="[KEY]", help="One entry; all by default.")] = "",
    board: BoardOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the entries of the blackboard: value, type, number of writes, age."""
    with reached(ctx, system) as there:
        executor = executor_in(there, robot)
        found = there.client.call(executor.service(BLACKBOARD), BlackboardRequest(key, board), BlackboardEntries)
    if as_json:
        show_json(found)
        return
    _show_entries(found)
    if found.boards and not key:
        say(f"sub-trees with a blackboard of their own: {', '.join(found.boards)}")


@mission.command("set", cls=TakesValues)
def set_entries(
    ctx: typer.Context,
    settings: Annotated[list[str], typer.Argument(metavar="KEY VALUE | KEY=VALUE...")],
    board: BoardOption = "",
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write one entry of the blackboard, or several at once, all or none; null removes one."""
    values = values_of(settings)
    with reached(ctx, system) as there:
        executor = executor_in(there, robot)
        written = there.client.call(executor.service(WRITE), WriteBlackboard(values, board), BlackboardEntries)
    if as_json:
        show_json(written)
        return
    _show_entries(written)


@mission.command("check")
def check(
    file: TreeFile,
    nodes: NodesOption = None,
    main: MainOption = "",
    stack: StackOption = None,
    trees: TreesOption = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Take no scripts that BehaviorTree.CPP would refuse.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Load a tree without a system, and report what is wrong where."""
    # The engine is loaded only here: every command of regraft pays for the imports at the top.
    from regraft.services.bt_executor import checking
    from regraft.services.bt_executor.authors.known_types import known_to_authors, library_known

    doubts: list[str] = []
    known = known_to_authors(nodes or [], stack, file, doubts)
    report = checking.check(file, known, main, strict=strict, library=library_known(trees, stack))
    report = replace(report, warnings=(*doubts, *report.warnings))
    if as_json:
        show_json(asdict(report))
    else:
        for found in report.errors:
            complain(str(found))
        for warning in report.warnings:
            say(f"warning: {warning}")
        if not report.errors:
            say(f"{file}: {report.tree}, {report.nodes} nodes: nothing wrong")
    if report.errors:
        raise typer.Exit(BAD_INPUT)


mission.command("break")(breakpoint_commands.set_breakpoint)
mission.command("breakpoints")(breakpoint_commands.list_breakpoints)
mission.command("clear")(breakpoint_commands.clear_breakpoints)
mission.command("continue")(breakpoint_commands.resume)
mission.command("next")(breakpoint_commands.go_to_next)
mission.command("models")(drawing.models)
mission.command("dot")(drawing.dot)
mission.command("dry-run")(trying.dry_run)
mission.command("convert")(converting.convert)
mission.command("replay")(replaying.replay)


def _with_tree(command: Command, file: Path | None, main: str) -> MissionCommand:
    if file is None and not main:
        raise BadInput(f"there is no tree to {command.value}: name a file, or by --main a tree of the library")
    return MissionCommand(command, mission_text(file) if file is not None else "", main)


def _give_tree(
    ctx: typer.Context, robot: str, system: str | None, command: MissionCommand, file: Path | None, as_json: bool
) -> None:
    """Give a command with a tree; the executor knows its text only, so the file is named here."""
    try:
        give_command(ctx, robot, system, command, as_json)
    except CallFailed as error:
        problem = error.problem.replace("<text>:", f"{file}:") if file is not None else error.problem
        raise CallFailed(error.service, error.answer, problem, code=error.code) from None


def _show_entries(found: BlackboardEntries) -> None:
    rows = [
        (entry.key, entry.value, entry.type, entry.sequence, "" if entry.age is None else seconds(entry.age))
        for entry in found.entries
    ]
    show_table(("entry", "value", "type", "writes", "age"), rows, empty="no entries")


def quality_line(quality: Quality) -> str:
    """Return how well a quality requirement is met as one line."""
    verdict = {None: "unknown", True: "satisfied", False: "not satisfied"}[quality.satisfied]
    metric = "" if quality.metric is None else f"metric {quality.metric:.3g}"
    more = quality.status or quality.reason
    parts = (verdict, metric, "" if more == verdict else more, "" if quality.active else "not active")
    return f"{quality.requirement} ({quality.attribute}): {', '.join(filter(None, parts))}"
