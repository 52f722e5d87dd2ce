"""``regraft certificates``: what hosts show each other over TLS."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from regraft.cli.terminal.options import JsonOption
from regraft.cli.terminal.output import say, show_json
from regraft.security.certificates import make


def certificates(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of the results; created if missing.")],
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="Hosts, 'local' for the first.")],
    addresses: Annotated[
        list[str] | None,
        typer.Option(
            "--address", metavar="ADDRESS", help="A name or IP address that hosts are reached by; may be repeated."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make certificates for hosts, signed by an authority of the folder's own, which is made first."""
    written = [str(path) for path in make(folder, names, addresses or ())]
    if as_json:
        show_json({"folder": str(folder), "written": written})
        return
    for path in written:
        say(path)
    say(f"a host needs ca.pem, bus.secret and the two files of its own; keep {folder / 'ca.key'} to yourself")
