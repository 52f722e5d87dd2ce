"""Names that fields had before, and what they are called now."""

from __future__ import annotations

from collections.abc import Container

FORMER_NAMES = {
    "cls": "class",
    "connections": "connect",
    "who": "actor",
    "text": "description",
    "longest_handler": "handler_timeout",
    "indispensable": "removal_forbidden",
    "makes_time": "is_time_source",
    "in_step": "lockstep",
    "begun": "started_as",
    "last_end": "exit_reason",
    "highest": "max_incarnation",
}
"""Names of fields in version 1 of the protocol, and in stack files of that time."""


def present_name(name: str, known: Container[str]) -> str | None:
    """Return which field of ``known`` had that name before; None if there is none, or one still has it.

    >>> present_name("cls", ["class", "host"])
    'class'
    >>> present_name("text", ["text", "description"])
    """
    present = FORMER_NAMES.get(name)
    return present if present in known and name not in known else None
