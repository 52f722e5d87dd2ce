"""Draws graphs by Graphviz's ``dot``."""

from __future__ import annotations

import shutil
import subprocess

TIMEOUT = 60.0
"""Seconds that drawing may take."""


class Missing(Exception):
    """No picture can be drawn here; the text states what is missing."""


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
