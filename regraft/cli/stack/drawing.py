"""Shows graphs in Graphviz's language, or draws them by its program ``dot``."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Annotated, Final

import typer

from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.output import say

TIMEOUT: Final = 60.0
"""Seconds that drawing may take."""
SVG, DOT = ".svg", ".dot"
GraphOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="FILE.dot|.svg", help="Write it to a file; .svg needs the program 'dot'."),
]


class Missing(Exception):
    """No picture can be drawn here; the text states what is missing."""


def check_suffix(out: Path | None) -> None:
    """Make sure that a file can take a graph; raises BadInput."""
    if out is not None and out.suffix not in (SVG, DOT):
        raise BadInput(f"--out {out}: must end in {DOT} or {SVG}")


def show_graph(text: str, out: Path | None) -> None:
    """Print a graph in Graphviz's language, or write it to a file, as a picture if it ends in .svg; raises BadInput."""
    check_suffix(out)
    if out is None:
        say(text)
        return
    try:
        out.write_bytes(svg(text) if out.suffix == SVG else f"{text}\n".encode())
    except (Missing, OSError) as error:
        raise BadInput(f"--out {out}: {getattr(error, 'strerror', None) or error}") from None


def svg(text: str) -> bytes:
    """Return a graph in Graphviz's language as a picture; raises Missing."""
    program = shutil.which("dot")
    if program is None:
        raise Missing("pictures need Graphviz's program 'dot': install the package graphviz, or write a .dot file")
    try:
        done = subprocess.run([program, "-Tsvg"], input=text.encode(), capture_output=True, timeout=TIMEOUT, check=True)
    except subprocess.TimeoutExpired:
        raise Missing(f"'dot' took longer than {TIMEOUT:g} s: write a .dot file") from None
    except subprocess.CalledProcessError as error:
        raise Missing(f"'dot' failed: {error.stderr.decode(errors='replace').strip()}") from None
    return done.stdout
