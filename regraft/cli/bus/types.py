"""``regraft types``: the message types, described by JSON Schema."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from regraft import run_directory
from regraft.bus_schema.encoding.registry import known_types
from regraft.bus_schema.encoding.shapes import JsonSchema
from regraft.bus_schema.encoding.topic_types import know_schema
from regraft.cli.bus import message_types
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import reached
from regraft.cli.terminal.options import JsonOption, SystemOption, chosen_system
from regraft.cli.terminal.output import complain, show_json, show_table
from regraft.process.trial.trial_import import check_imports
from regraft.stack.classes import import_problem, look_in


def types(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="[TYPE]", help="A type such as regraft/Twist.")] = "",
    modules: Annotated[
        list[str] | None,
        typer.Option("--import", metavar="MODULE", help="Import a module that defines types; may be repeated."),
    ] = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List message types, or print the JSON Schema of one: also one that only a running system knows."""
    look_in(Path.cwd())
    check_imports(modules or [], complain)
    for module in modules or []:
        problem = import_problem(module)
        if problem:
            raise BadInput(problem)
    if name:
        show_json(_schema(ctx, name, system))
        return
    know_schema()
    kinds = known_types()
    if as_json:
        show_json(
            {"types": [{"name": kind.name, "version": kind.version, "encoding": kind.encoding} for kind in kinds]}
        )
        return
    rows = ((kind.name, kind.version, (kind.cls.__doc__ or "").split("\n")[0]) for kind in kinds)
    show_table(("type", "version", ""), rows, empty="no types")


def _schema(ctx: typer.Context, name: str, system: str | None) -> JsonSchema:
    """Return the schema of a type that is known here, or else in the system that is meant; raises BadInput."""
    try:
        return message_types.named(name).schema
    except BadInput:
        if chosen_system(ctx, system) is None and not run_directory.running():
            raise
    with reached(ctx, system) as there:
        return message_types.described(there, name).schema
