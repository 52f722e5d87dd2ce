"""``regraft logs`` and ``events``: what the components write and report."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Annotated

import typer

from regraft import run_directory
from regraft.bus.interface import BusError
from regraft.bus_schema.keys import component_name, system_name
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.robots.robot_view import ALL
from regraft.bus_schema.suggestions import instead_of
from regraft.cli.bus.sampling import Backlog, tell_missed
from regraft.cli.outcomes import BadInput, Unreachable
from regraft.cli.running_system import reached
from regraft.cli.system.display import event_line
from regraft.cli.terminal.numbers import seconds, whole
from regraft.cli.terminal.options import ComponentArgument, JsonOption, RobotOption, SystemOption, chosen_system
from regraft.cli.terminal.output import pass_on, say, show_json
from regraft.client import NoSuchHost

LOOK_INTERVAL = 0.1
MAX_BYTES = 1024 * 1024
HOST_LOG = "host"
"""The name by which the log of this machine's host is shown."""


def logs(
    ctx: typer.Context,
    component: ComponentArgument,
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="Follow new output, until Ctrl-C or the system's end.")
    ] = False,
    lines: Annotated[
        int, typer.Option("--lines", "-n", metavar="N", parser=whole(1, 10_000), help="The number of entries.")
    ] = 100,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print the end of a component's log ('host': the host's own), also of a system that has ended."""
    component_name(component)
    chosen = chosen_system(ctx, system)
    name = system_name(chosen) if chosen is not None else run_directory.find().system
    path = _log_file(ctx, name, component)
    if path is None:
        _ask_host(ctx, system, component, lines, follow, as_json)
        return
    info = run_directory.read_info(name)
    shown, position = tail(path, lines, unfinished=not follow)
    _show(component, path, shown, as_json=as_json, compact=follow)
    while follow:
        is_over = not _continues(name, info)  # looked at first: what was written until then is shown
        more, position = grown(path, position, unfinished=is_over)
        if more:
            _show(component, path, more, as_json=as_json, compact=True)
        elif is_over:
            raise Unreachable(f"{name} has ended")
        else:
            time.sleep(LOOK_INTERVAL)


def _continues(name: str, info: run_directory.RunInfo | None) -> bool:
    """Return whether a run has not ended; a host that has joined has a folder, and no information of a run."""
    return run_directory.is_running(name) if info is None else run_directory.continues(info)


def _show(component: str, file: Path | None, lines: Sequence[str], *, as_json: bool, compact: bool = False) -> None:
    if as_json:
        path = str(file) if file else None
        show_json({"component": component, "file": path, "lines": list(lines)}, compact=compact)
        return
    for line in lines:
        pass_on(line)


def _ask_host(ctx: typer.Context, system: str | None, component: str, lines: int, follow: bool, as_json: bool) -> None:
    """Print the log of a component on another host, as that host has it."""
    if follow:
        raise BadInput(f"{component} runs on another host: its log can be followed there alone")
    with reached(ctx, system) as there:
        try:
            shown = there.client.logs(component, lines)
        except NoSuchHost as error:
            raise Unreachable(f"{component} runs on another host, which has its log: {error}") from None
    _show(component, None, shown, as_json=as_json)


def _is_elsewhere(ctx: typer.Context, system: str, component: str) -> bool:
    """Return whether another host has the process of a component; false if the system cannot be reached."""
    try:
        with reached(ctx, system) as there:
            seen = there.client.components().get(component)
    except (run_directory.NotRunning, run_directory.NoRoom, BusError):
        return False
    return seen is not None and seen.host not in (None, LOCAL)


def _log_file(ctx: typer.Context, name: str, component: str) -> Path | None:
    """Return the file of a component's log, None if another host has it; raises BadInput, Unreachable."""
    folder = run_directory.folder(name) / "logs"
    try:
        files = os.listdir(folder)
    except (FileNotFoundError, NotADirectoryError):
        raise Unreachable(f"no system named {name!r} has run here") from None
    except OSError as error:
        raise _cannot_read(folder, error) from None
    # A component may have written a log here before it was moved to another host.
    if component != HOST_LOG and _is_elsewhere(ctx, name, component):
        return None
    file = f"{component}.log"
    if file not in files:
        hint = instead_of(component, [found.removesuffix(".log") for found in files if found.endswith(".log")])
        raise BadInput(f"{name} has no log of {component!r}; {hint} (what 'regraft run' starts logs to its terminal)")
    return folder / file


def _cannot_read(path: Path, error: OSError) -> BadInput:
    return BadInput(f"cannot read {path}: {error.strerror}")


def tail(path: Path, count: int, *, unfinished: bool = False) -> tuple[list[str], int]:
    """Return the last lines of a file, and the position behind them; ``unfinished`` takes one without end, too.

    Raises:
        BadInput: it cannot be read.
    """
    try:
        with path.open("rb") as log:
            end = log.seek(0, 2)
            log.seek(max(0, end - MAX_BYTES))
            data = log.read(MAX_BYTES)
    except OSError as error:
        raise _cannot_read(path, error) from None
    whole = data if unfinished else data[: data.rfind(b"\n") + 1]
    position = end - len(data) + len(whole)
    return whole.decode(errors="replace").splitlines()[-count:], position


def grown(path: Path, position: int, *, unfinished: bool = False) -> tuple[list[str], int]:
    """Return the whole lines that a file has behind ``position``, and the position behind them.

    ``unfinished`` takes one without end, too. A file that has become shorter was begun again. One that is gone has
    none.

    Raises:
        BadInput: it cannot be read.
    """
    try:
        with path.open("rb") as log:
            end = log.seek(0, 2)
            start = position if position <= end else 0
            log.seek(start)
            data = log.read(MAX_BYTES)
    except FileNotFoundError:
        return [], 0
    except OSError as error:
        raise _cannot_read(path, error) from None
    whole = data if unfinished or len(data) == MAX_BYTES else data[: data.rfind(b"\n") + 1]
    return whole.decode(errors="replace").splitlines(), start + len(whole)


def events(
    ctx: typer.Context,
    kind: Annotated[str, typer.Option("--kind", metavar="PREFIX", help="Only kinds such as adaptation.")] = "",
    count: Annotated[
        int | None, typer.Option("--count", metavar="N", parser=whole(1), help="End after this number.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", parser=seconds(0.0), help="End after this time.")
    ] = None,
    robot: RobotOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print what happens, as it happens; as JSON, one document per line."""
    waiting: Backlog[Event] = Backlog()
    with reached(ctx, system) as there:
        view = there.known.of_robot(robot).view if robot else ALL
        there.client.events(waiting.take)
        wanted = (
            event
            for event in waiting.coming(duration, there.check)
            if event.kind.startswith(kind) and view.has_component(event.subject)
        )
        try:
            for event in islice(wanted, count):
                if as_json:
                    show_json(event, compact=True)
                else:
                    say(event_line(event, there.client.clock()))
        finally:
            tell_missed(waiting.missed)
