"""``regraft ps`` and ``regraft down``: what is running, and its end."""

from __future__ import annotations

import os
import signal
import time
from typing import Annotated, Any

import typer

from regraft import run_directory
from regraft.bus.interface import BusError
from regraft.bus_schema.model.robots.robot_view import ALL
from regraft.cli.outcomes import BadInput, Failed, Unreachable
from regraft.cli.running_system import joined, plain_info
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption, chosen_system
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.client import ComponentSeen
from regraft.patience import Patience
from regraft.run_directory import RunInfo

END_TIMEOUT = 20.0
"""Seconds that a system may take to end, more on a crowded machine: as its host gives them to the components."""
LOOK_INTERVAL = 0.02
SILENT_TIMEOUT = 1.0
"""Seconds without a status after which it is shown how long ago the last one was."""


def ps(ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False) -> None:
    """List the running systems and their components: state, process, restarts, errors."""
    name = chosen_system(ctx, system)
    infos = [run_directory.find(name)] if name is not None or robot else run_directory.running()
    found = [{**plain_info(info), **_components(info, robot)} for info in infos]
    if as_json:
        show_json({"systems": found})
    elif not found:
        say("no system is running: start one with 'regraft up STACK'")
    else:
        for entry in found:
            _show(entry)
    unreachable = [entry["system"] for entry in found if entry["problem"]]
    if unreachable:
        raise Unreachable(f"{', '.join(unreachable)} cannot be reached, though its process has not ended")


def _components(info: RunInfo, robot: str) -> dict[str, Any]:
    try:
        with joined(info) as there:
            seen = there.client.components()
            view = there.known.of_robot(robot).view if robot else ALL
            return {
                "problem": None,
                "components": [plain_component(each) for name, each in seen.items() if view.has_component(name)],
            }
    except BusError as error:
        return {"problem": str(error), "components": []}


def plain_component(seen: ComponentSeen) -> dict[str, Any]:
    """Return a component as seen from outside as plain data."""
    status, process = seen.status, seen.process
    return {
        "name": seen.name,
        "alive": seen.alive,
        "state": seen.state.value if seen.state else None,
        "incarnation": process.incarnation if process else status.incarnation if status else None,
        "host": seen.host,
        "process": process.state.value if process else None,
        "pid": process.pid or None if process else None,
        "restarts": process.restarts if process else 0,
        "exit_reason": process.exit_reason if process else "",
        "revision": status.revision if status else None,
        "silent_s": None if seen.age is None else round(seen.age, 3),
        "lost": status.lost if status else 0,
        "refused": status.refused if status else 0,
        "error": seen.error,
        "failure": seen.failure,
        "detail": seen.detail,
        "values": seen.values,
    }


def _show(entry: dict[str, Any]) -> None:
    clock = "simulated time" if entry["simulated"] else "real clock"
    gateway = f", gateway {entry['gateway']}" if entry["gateway"] else ""
    say(f"{entry['system']}  process {entry['pid']}, {clock}, {entry['stack']}{gateway}")
    rows = [
        (f"  {c['name']}", shown_state(c), c["incarnation"], c["pid"], c["restarts"], remark(c))
        for c in entry["components"]
    ]
    show_table(("  component", "state", "run", "pid", "restarts", ""), rows, empty="  no components")


def shown_state(component: dict[str, Any]) -> str:
    """Return a component's state in a word: that of its process where it is not running."""
    process = component["process"]
    if process not in (None, "running"):
        return str(process)
    if not component["alive"]:
        return "running" if process else "gone"
    return component["state"] or "starting"


def remark(component: dict[str, Any]) -> str:
    """Return further remarks about a component, the worst first."""
    silent = component["silent_s"]
    error, failure = component["error"], component["failure"]
    parts = [failure and f"failed: {failure}", "" if error == failure else error, component["detail"]]
    if component["alive"] and silent is not None and silent > SILENT_TIMEOUT:
        parts.insert(0, f"silent for {silent:.1f} s")
    if component["exit_reason"]:
        parts.append(f"last ended: {component['exit_reason']}")
    parts += [f"{component[count]} messages {count}" for count in ("lost", "refused") if component[count]]
    return "; ".join(filter(None, parts))


def down(
    ctx: typer.Context,
    named: Annotated[str | None, typer.Argument(metavar="[SYSTEM]", help="Needed only if several run.")] = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """End a running system, and wait until all its processes have ended."""
    if named is not None and system is not None and named != system:
        raise BadInput(f"SYSTEM is {named!r}, but --system is {system!r}: omit one")
    info = run_directory.find(chosen_system(ctx, named or system))
    began = time.monotonic()
    try:
        os.kill(info.pid, signal.SIGTERM)
    except ProcessLookupError:
        complain(f"process {info.pid} has ended already")
    except PermissionError:
        raise Failed(f"process {info.pid} belongs to another user, who has to end it") from None
    patience = Patience(END_TIMEOUT)
    while (runs := run_directory.continues(info)) and not patience.is_over():
        time.sleep(LOOK_INTERVAL)
    took = time.monotonic() - began
    if runs:
        raise Failed(f"{info.system} has not ended within {took:.0f} s; by force: kill -9 {info.pid}")
    if as_json:
        show_json({"system": info.system, "ended": True, "seconds": round(took, 3)})
    else:
        say(f"{info.system} ended after {took:.1f} s")
