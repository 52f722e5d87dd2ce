"""The command line with what our own packages add to it, and with nothing that others do."""

from __future__ import annotations

from importlib.metadata import entry_points

import typer

from regraft.cli.extensions import GROUP, add_extensions
from regraft.cli.main import build


def whole() -> typer.Typer:
    """Return all commands of this project."""
    app = build()
    ours = (entry for entry in entry_points(group=GROUP) if entry.value.startswith("services."))
    add_extensions(app, tuple(ours))
    return app
