"""``regraft mode``: enters a mode of the stack."""

from __future__ import annotations

from typing import Annotated

import typer

from bus_schema.adaptation import EnterMode
from regraft.cli import managing
from regraft.cli.options import JsonOption, ReasonOption, SystemOption
from regraft.cli.reach import reached


def mode(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="MODE", help="A mode that the stack file names.")],
    reason: ReasonOption = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Enter a mode of the stack: all of its changes are made, or none."""
    with reached(ctx, system) as there:
        report = managing.change(there, EnterMode(name), reason or f"mode {name}")
        managing.show_report(report, as_json=as_json)
