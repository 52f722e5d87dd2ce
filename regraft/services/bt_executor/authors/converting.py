"""``regraft mission convert``: trees of BehaviorTree.CPP's version 3 as trees of version 4."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from regraft.cli.outcomes import FAILED, BadInput
from regraft.cli.terminal.output import complain
from regraft.services.bt_executor.authors.file_text import mission_text

OldFile = Annotated[Path, typer.Argument(metavar="FILE", help="BehaviorTree.CPP XML, version 3.")]
OutOption = Annotated[
    Path | None, typer.Option("--out", metavar="FILE.xml", help="Write it to a file; by default it is printed.")
]


def convert(file: OldFile, out: OutOption = None) -> None:
    """Convert a file of BehaviorTree.CPP's version 3 to version 4; comments and layout stay.

    The exit code is 1 if something has no equivalent, and remains to be done by hand.
    """
    from behavior_tree import TreeError
    from behavior_tree.xml.version3 import to_version_4

    try:
        converted = to_version_4(mission_text(file), str(file))
    except TreeError as error:
        raise BadInput(str(error)) from None
    if out is None:
        typer.echo(converted.text)
    else:
        try:
            out.write_text(converted.text, encoding="utf-8")
        except OSError as error:
            raise BadInput(f"--out {out}: {error.strerror}") from None
    for note in converted.changed:
        complain(f"note: {note}")
    for note in converted.left:
        complain(note)
    if converted.left:
        raise typer.Exit(FAILED)
