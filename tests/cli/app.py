"""The command line with what our own packages add to it, and with nothing that others do."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.metadata import EntryPoint

import typer
import typer.testing

from regraft.cli.extensions import GROUP, add_extensions
from regraft.cli.main import build
from tests.support.paths import ROOT

# A runner makes all commands anew each time that it runs one, which takes longer than most commands.
vars(typer.testing)["_get_command"] = cache(typer.main.get_command)


@cache
def whole() -> typer.Typer:
    """Return all commands of this project."""
    app = build()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    ours = project["entry-points"][GROUP]
    add_extensions(app, tuple(EntryPoint(name, place, GROUP) for name, place in ours.items()))
    return app
