"""The command line with ``regraft evaluate``, and with nothing that others add: also a program."""

from __future__ import annotations

import typer

from regraft.cli.main import build
from regraft.evaluation.command_line import evaluate


def command_line() -> typer.Typer:
    """Return the command line with ``regraft evaluate``."""
    app = build()
    app.add_typer(evaluate, name="evaluate")
    return app


if __name__ == "__main__":
    command_line()(prog_name="regraft")
