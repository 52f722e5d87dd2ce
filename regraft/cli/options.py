"""Options and arguments that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

SystemOption = Annotated[
    str | None,
    typer.Option("--system", metavar="NAME", help="The system to talk to; needed only if several run."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON.")]
ReasonOption = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why, for the journal.")]
TimeoutOption = Annotated[float, typer.Option("--timeout", metavar="SECONDS", min=0.1, help="How long to wait.")]
ComponentArgument = Annotated[str, typer.Argument(metavar="COMPONENT", help="A component's name.")]


def chosen_system(ctx: typer.Context, system: str | None) -> str | None:
    """Return the system named after the command or, if none is, before it (``regraft --system NAME ...``)."""
    if system is not None:
        return system
    before: str | None = ctx.find_root().params.get("system")
    return before
