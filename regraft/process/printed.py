"""The text that a process has printed and still keeps: a copy of the process would write it once more."""

from __future__ import annotations

import contextlib
import os
import sys


def write_out() -> None:
    """Write it, as far as that is possible; otherwise this process continues to keep it."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):  # commands and authors' modules put streams of their own there
            stream.flush()


def write_or_drop() -> None:
    """Write it. Where standard output takes nothing, drop it, and all that is printed from now on."""
    try:
        sys.stdout.flush()
    except Exception:
        give_up_output()
    write_out()


def give_up_output() -> None:
    """Send standard output to nowhere from now on, with what it still keeps and could not write."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)
