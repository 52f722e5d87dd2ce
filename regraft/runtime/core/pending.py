"""An answer to a control query that has to wait."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

AWAIT_AT_MOST = 100_000_000
"""Nanoseconds of wall-clock time that an answer waits, unless its query has another bound."""


@dataclass(slots=True)
class Pending:
    """An answer that waits: ``finish`` returns it once ``ready`` is true, or after ``at_most`` nanoseconds.

    ``afterwards`` is called when the query has been answered.
    """

    ready: Callable[[], bool]
    finish: Callable[[], object]
    at_most: int = AWAIT_AT_MOST
    afterwards: Callable[[], None] | None = None
