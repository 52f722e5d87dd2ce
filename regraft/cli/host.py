"""``regraft host``, ``logs`` and ``events``: what runs the components, and what they say."""

from __future__ import annotations

import queue
import time
from pathlib import Path
from typing import Annotated

import typer

from bus_schema import codec
from bus_schema.keys import component_name, system_name
from bus_schema.messages.health import Event
from regraft import rundir
from regraft.cli.display import event_line
from regraft.cli.group import BadInput, Unreachable
from regraft.cli.options import ComponentArgument, JsonOption, SystemOption, chosen_system
from regraft.cli.output import say, show_json, show_table
from regraft.cli.reach import reached

LOOK_EVERY = 0.1
MOST_BYTES = 1024 * 1024


def host(ctx: typer.Context, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """List the hosts and the processes that they run."""
    with reached(ctx, system) as there:
        hosts = there.client.hosts()
    if as_json:
        plain = [
            {
                "name": h.name,
                "alive": h.alive,
                "silent_s": h.age,
                "status": codec.to_plain(h.status) if h.status else None,
            }
            for h in hosts.values()
        ]
        show_json({"hosts": plain})
        return
    rows = [
        (h.name, p.component, p.state.value, p.pid or "", p.incarnation, p.restarts, p.last_end)
        for h in hosts.values()
        for p in (h.status.processes if h.status else ())
    ]
    show_table(("host", "component", "process", "pid", "run", "restarts", "last ended"), rows, empty="no hosts")


def logs(
    ctx: typer.Context,
    component: ComponentArgument,
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Go on with what comes, until Ctrl-C.")] = False,
    lines: Annotated[int, typer.Option("--lines", "-n", metavar="N", min=1, max=10_000, help="How many.")] = 100,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print the end of a component's log ('host': the host's own), also of a system that has ended."""
    component_name(component)
    path = _log_file(ctx, system, component)
    shown, position = tail(path, lines)
    if as_json:
        show_json({"component": component, "file": str(path), "lines": shown})
        return
    for line in shown:
        say(line)
    while follow:
        more, position = grown(path, position)
        for line in more:
            say(line)
        if not more:
            time.sleep(LOOK_EVERY)


def _log_file(ctx: typer.Context, system: str | None, component: str) -> Path:
    chosen = chosen_system(ctx, system)
    name = system_name(chosen) if chosen is not None else rundir.find().system
    folder = rundir.folder(name) / "logs"
    if not folder.is_dir():
        raise Unreachable(f"no system named {name!r} has run here")
    path = folder / f"{component}.log"
    if not path.exists():
        there = ", ".join(sorted(found.stem for found in folder.glob("*.log"))) or "none"
        raise BadInput(
            f"{name} has no log of {component!r}; it has: {there} (what 'regraft run' starts logs to its terminal)"
        )
    return path


def tail(path: Path, count: int) -> tuple[list[str], int]:
    """Return the last lines of a file, and the position behind them."""
    with path.open("rb") as log:
        end = log.seek(0, 2)
        log.seek(max(0, end - MOST_BYTES))
        data = log.read(MOST_BYTES)
    whole = data[: data.rfind(b"\n") + 1]
    position = end - len(data) + len(whole)
    return whole.decode(errors="replace").splitlines()[-count:], position


def grown(path: Path, position: int) -> tuple[list[str], int]:
    """Return the whole lines that a file has behind ``position``, and the position behind them.

    A file that has become shorter was begun anew.
    """
    try:
        with path.open("rb") as log:
            end = log.seek(0, 2)
            start = position if position <= end else 0
            log.seek(start)
            data = log.read(MOST_BYTES)
    except FileNotFoundError:
        return [], 0
    whole = data[: data.rfind(b"\n") + 1] if len(data) < MOST_BYTES else data
    return whole.decode(errors="replace").splitlines(), start + len(whole)


def events(
    ctx: typer.Context,
    kind: Annotated[str, typer.Option("--kind", metavar="PREFIX", help="Only kinds such as adaptation.")] = "",
    count: Annotated[int | None, typer.Option("--count", metavar="N", min=1, help="End after so many.")] = None,
    duration: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", min=0.0, help="End after so long.")
    ] = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print what happens, as it happens; as JSON, one document per line."""
    waiting: queue.SimpleQueue[Event] = queue.SimpleQueue()
    end = None if duration is None else time.monotonic() + duration
    shown = 0
    with reached(ctx, system) as there:
        there.client.events(waiting.put)
        while (count is None or shown < count) and (end is None or time.monotonic() < end):
            try:
                event = waiting.get(timeout=LOOK_EVERY)
            except queue.Empty:
                continue
            if not event.kind.startswith(kind):
                continue
            shown += 1
            if as_json:
                show_json(event, compact=True)
            else:
                say(event_line(event, there.client.clock()))
