"""How a command ends: its exit codes, and an exception for each."""

from __future__ import annotations

WELL, FAILED, BAD_INPUT, NOT_REACHABLE, INTERRUPTED = 0, 1, 2, 3, 130

EXIT_CODES = """\
\b
Exit codes:
  0    success
  1    what was asked for failed: an adaptation was rejected or rolled back, a call failed
  2    a mistake in what was typed, a file with errors, a system that runs already, a port in use: nothing was done
  3    no such system, or it cannot be reached
  130  interrupted
"""


class BadInput(Exception):
    """A command that cannot be carried out as typed; the text states what is wrong and what would be right."""


class Unreachable(Exception):
    """A system, or the part of it that is needed, is not there."""


class Failed(Exception):
    """A request that failed."""
