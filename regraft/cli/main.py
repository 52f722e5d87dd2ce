"""The ``regraft`` command, put together."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from regraft.cli.access.certificates import certificates
from regraft.cli.access.token import token
from regraft.cli.adaptation.adapt import adapt, cancel, confirm, undo
from regraft.cli.adaptation.connect import connect, disconnect
from regraft.cli.adaptation.estimate import estimate
from regraft.cli.adaptation.journal import journal
from regraft.cli.adaptation.lifecycle import lifecycle
from regraft.cli.adaptation.mode import mode
from regraft.cli.adaptation.planner import planner
from regraft.cli.adaptation.remove import remove
from regraft.cli.adaptation.swap import move, swap
from regraft.cli.bus.param import param
from regraft.cli.bus.quality import quality
from regraft.cli.bus.service import action, goal, service
from regraft.cli.bus.topic import topic
from regraft.cli.bus.types import types
from regraft.cli.extensions import add_extensions
from regraft.cli.group import Commands, show_error, want_json
from regraft.cli.objectives.commands import objective
from regraft.cli.outcomes import BAD_INPUT, EXIT_CODES, FAILED, BadInput
from regraft.cli.stack.commands import stack
from regraft.cli.system.doctor import doctor
from regraft.cli.system.host import host
from regraft.cli.system.logs import events, logs
from regraft.cli.system.ps import down, ps
from regraft.cli.system.run import run
from regraft.cli.system.up import up
from regraft.cli.terminal import standard_streams
from regraft.cli.terminal.standard_streams import CannotWrite
from regraft.process.printed import give_up_output
from regraft.run_directory import NoHome
from regraft.system.capacity import TooMany, check_files

COMMANDS = (
    *(up, down, ps, run, adapt, confirm, cancel, undo, connect, disconnect, remove, swap, move, mode),
    *(estimate, host, logs, events, certificates, doctor, types),
)
GROUPS = {
    "journal": journal,
    "param": param,
    "lifecycle": lifecycle,
    "topic": topic,
    "service": service,
    "action": action,
    "goal": goal,
    "planner": planner,
    "objective": objective,
    "quality": quality,
    "token": token,
    "stack": stack,
}


def common(
    system: Annotated[
        str | None,
        typer.Option(
            "--system",
            metavar="NAME",
            envvar="REGRAFT_SYSTEM",
            help="The system; a command about a running system takes it behind its name too.",
        ),
    ] = None,
) -> None:
    """Run and adapt robot systems; every command has a --help of its own."""


def build(asked: str = "") -> typer.Typer:
    """Return the command line without what other packages add: all of it, or the command or group ``asked`` alone."""
    made = typer.Typer(
        name="regraft",
        cls=Commands,
        epilog=EXIT_CODES,
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    made.callback()(common)
    for command in COMMANDS:
        if asked in ("", command.__name__):
            made.command()(command)
    for name, group in GROUPS.items():
        if asked in ("", name):
            made.add_typer(group, name=name)
    return made


def _asked(words: list[str]) -> str:
    """Return the command or group of ours that the words begin with; empty if all have to be known."""
    first = words[0] if words else ""
    return first if first in GROUPS or any(first == command.__name__ for command in COMMANDS) else ""


def _has_a_folder() -> bool:
    try:
        Path.cwd()
    except OSError:
        return False
    return True


def main() -> None:
    """Run the command line of this process."""
    standard_streams.prepare()
    try:
        check_files()
        # Reading the signatures of all commands, and loading those of other packages, takes a fifth of the start.
        asked = _asked(sys.argv[1:])
        app = build(asked)
        if not asked:
            add_extensions(app)
        app(prog_name="regraft")
    except (TooMany, NoHome) as error:
        _end(error, BAD_INPUT)
    except FileNotFoundError:
        if _has_a_folder():
            raise
        _end(BadInput("the working folder is not there any more: change to another one"), BAD_INPUT)
    except CannotWrite as error:
        give_up_output()
        _end(error, FAILED)


def _end(error: Exception, code: int) -> NoReturn:
    show_error(error, code, as_json=want_json(sys.argv[1:]))
    sys.exit(code)
