"""``regraft stack``: checks, shows and draws a stack without running it."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

import typer

from regraft.cli.stack.drawing import GraphOption, check_suffix, show_graph
from regraft.cli.stack.graph import dot
from regraft.cli.stack.resolved import module_folders, resolved, with_origins
from regraft.cli.stack.yaml_text import yaml_text
from regraft.cli.terminal.options import JsonOption, OverridesOption, ParametersOption, PlacesOption, StackArgument
from regraft.cli.terminal.output import complain, say, show_json
from regraft.stack import Stack as StackFile
from regraft.stack import check_with_classes, load_as_asked
from regraft.stack.installed import stack_file

stack = typer.Typer(
    help="Check, show and draw stacks without running them.", no_args_is_help=True, rich_markup_mode=None
)


@stack.command("check")
def check(
    file: StackArgument,
    overrides: OverridesOption = None,
    params: ParametersOption = None,
    places: PlacesOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check a stack with all that it includes; report everything that is wrong."""
    found = _loaded(file, overrides, params, places)
    check_with_classes(found)
    parts = {name: len(getattr(found.architecture, name)) for name in ("components", "topics", "constraints", "modes")}
    if as_json:
        show_json({"system": found.name, **parts})
    else:
        say(f"{found.file}: {', '.join(f'{count} {name}' for name, count in parts.items() if count)}: all right")


@stack.command("show")
def show(
    file: StackArgument,
    overrides: OverridesOption = None,
    params: ParametersOption = None,
    places: PlacesOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print a stack as one file, with what it includes and where each value comes from."""
    found = _loaded(file, overrides, params, places)
    document, folders = resolved(found), module_folders(found)
    if as_json:
        show_json(with_origins(document))
        return
    if folders:
        where = shlex.quote(os.pathsep.join(map(str, folders)))
        say(f"# The modules of the stack are not in this file, which needs: PYTHONPATH={where}")
    say(yaml_text(document))


@stack.command("graph")
def graph(
    file: StackArgument,
    overrides: OverridesOption = None,
    params: ParametersOption = None,
    places: PlacesOption = None,
    out: GraphOption = None,
) -> None:
    """Draw components and topics as a graph, in Graphviz's language or as a picture."""
    check_suffix(out)  # before the stack is loaded
    show_graph(dot(_loaded(file, overrides, params, places).architecture), out)


def _loaded(file: Path, overrides: list[str] | None, params: list[Path] | None, places: list[str] | None) -> StackFile:
    """Return the stack as ``regraft up`` would run it; raises StackError."""
    return load_as_asked(stack_file(file), params, overrides, places, notice=complain)
