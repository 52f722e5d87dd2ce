"""The ``regraft`` command, put together."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from regraft.capacity import TooMany, check_files
from regraft.cli import standard_streams
from regraft.cli.adapt import adapt, cancel, confirm, undo
from regraft.cli.certificates import certificates
from regraft.cli.connect import connect
from regraft.cli.doctor import doctor
from regraft.cli.estimate import estimate
from regraft.cli.extensions import add_extensions
from regraft.cli.group import BAD_INPUT, EXIT_CODES, FAILED, Commands
from regraft.cli.host import host
from regraft.cli.journal import journal
from regraft.cli.lifecycle import lifecycle
from regraft.cli.logs import events, logs
from regraft.cli.mode import mode
from regraft.cli.output import complain
from regraft.cli.param import param
from regraft.cli.planner import planner
from regraft.cli.ps import down, ps
from regraft.cli.remove import remove
from regraft.cli.run import run
from regraft.cli.service import action, goal, service
from regraft.cli.standard_streams import CannotWrite
from regraft.cli.swap import move, swap
from regraft.cli.token import token
from regraft.cli.topic import topic
from regraft.cli.types import types
from regraft.cli.up import up

COMMANDS = (
    *(up, down, ps, run, adapt, confirm, cancel, undo, connect, remove, swap, move, mode),
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
    "token": token,
}


def common(
    system: Annotated[
        str | None,
        typer.Option(
            "--system",
            metavar="NAME",
            envvar="REGRAFT_SYSTEM",
            help="The system to talk to; a command about a running system takes it behind its name too.",
        ),
    ] = None,
) -> None:
    """Run and adapt robot systems; every command has a --help of its own."""


def build() -> typer.Typer:
    """Return the command line without what other packages add."""
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
        made.command()(command)
    for name, group in GROUPS.items():
        made.add_typer(group, name=name)
    return made


def main() -> None:
    """Run the command line of this process."""
    standard_streams.prepare()
    try:
        check_files()
        app = build()
        add_extensions(app)
        app(prog_name="regraft")
    except TooMany as error:
        complain(str(error))
        sys.exit(BAD_INPUT)
    except CannotWrite as error:
        standard_streams.give_up_output()
        complain(str(error))
        sys.exit(FAILED)
