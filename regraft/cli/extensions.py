"""Commands from other packages: entry points of the group ``regraft.commands``."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

import typer

from regraft.cli.terminal.output import complain

GROUP = "regraft.commands"


def add_extensions(app: typer.Typer, found: tuple[EntryPoint, ...] | None = None) -> None:
    """Add to ``app`` what is installed: each entry point names a function or a ``typer.Typer``.

    The entry point's name is the command's. One that cannot be loaded is reported and left out.
    """
    for entry in sorted(tuple(entry_points(group=GROUP)) if found is None else found, key=lambda entry: entry.name):
        try:
            command = entry.load()
        except Exception as error:
            complain(f"the command {entry.name!r} from {entry.value} is left out: {type(error).__name__}: {error}")
            continue
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=entry.name)
        else:
            app.command(entry.name)(command)
