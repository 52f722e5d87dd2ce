"""The ``regraft`` command, put together."""

from __future__ import annotations

from typing import Annotated

import typer

from regraft.cli.group import EXIT_CODES, Commands
from regraft.cli.ps import down, ps
from regraft.cli.run import run
from regraft.cli.up import up

app = typer.Typer(
    name="regraft",
    cls=Commands,
    help="Runs and adapts robot systems.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def common(
    system: Annotated[
        str | None,
        typer.Option(
            "--system",
            metavar="NAME",
            envvar="REGRAFT_SYSTEM",
            help="The system that commands are about; may be given after the command too.",
        ),
    ] = None,
) -> None:
    """Runs and adapts robot systems: every command has its own --help."""


for command in (up, down, ps, run):
    app.command()(command)


def main() -> None:
    """Run the command line of this process."""
    app()
