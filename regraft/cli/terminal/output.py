"""Output of commands: tables and lines for people, one JSON document (or one per line) for programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import typer
from rich.console import Console
from rich.table import Table

from regraft.client import as_json

GAP = "  "


def console() -> Console:
    """Return a console for what standard output is now; it takes text as it is, brackets and all."""
    return Console(markup=False, emoji=False, highlight=False, soft_wrap=True)


def harmless(text: str) -> str:
    """Return a text without what a terminal would obey: much of what is shown was written by somebody else.

    >>> harmless("red\\x1b[31m, reversed\\u202e")
    'red\\\\x1b[31m, reversed\\\\u202e'
    """
    return _escaped(text, lambda c: c.encode("unicode_escape").decode())


def _escaped(text: str, escape: Callable[[str], str]) -> str:
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else escape(c) for c in text)


def say(text: str) -> None:
    """Print a line."""
    typer.echo(harmless(text))


def pass_on(text: str) -> None:
    """Print a line as a component wrote it into its log, colours and all."""
    typer.echo(text)


def complain(text: str) -> None:
    """Print what went wrong."""
    typer.echo(f"regraft: {harmless(text)}", err=True)


def show_json(value: Any, *, compact: bool = False, err: bool = False) -> None:
    """Print a message or plain data as a JSON document; ``compact`` on one line, for streams of documents."""
    encoding = (sys.stderr if err else sys.stdout).encoding or "utf-8"
    lacks_some = not encoding.lower().startswith("utf")  # the escapes of standard output are not those of JSON
    text = json.dumps(as_json(value), indent=None if compact else 2, ensure_ascii=lacks_some)
    typer.echo(_escaped(text, lambda c: json.dumps(c).strip('"')), err=err)


def show_table(headings: Sequence[str], rows: Iterable[Sequence[object]], *, empty: str) -> None:
    """Print rows under headings, or ``empty`` if there are none; for a pipe, whole and without decoration."""
    texts = [["" if cell is None else harmless(str(cell)) for cell in row] for row in rows]
    if not texts:
        say(empty)
    elif sys.stdout.isatty():
        table = Table(*headings, box=None, pad_edge=False, header_style="bold")
        for row in texts:
            table.add_row(*row)
        console().print(table)
    else:
        for line in plain_table(headings, texts):
            say(line)


def plain_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a table as lines, its columns aligned.

    >>> plain_table(["name", "state"], [["navigator", "active"]])
    ['name       state', 'navigator  active']
    """
    lines = [[cell.replace("\n", " ") for cell in row] for row in (headings, *rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return [GAP.join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]


def seconds(value: float) -> str:
    """Return a duration as people write it.

    >>> [seconds(0.0123), seconds(3.21), seconds(200.0)]
    ['12 ms', '3.2 s', '200 s']
    """
    if value < 1.0:
        return f"{value * 1e3:.0f} ms"
    return f"{value:.1f} s" if value < 100.0 else f"{value:.0f} s"
