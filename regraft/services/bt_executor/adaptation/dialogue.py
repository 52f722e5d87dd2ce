"""Asking in several turns without waiting: a generator yields what has to be answered before it continues."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Final, TypeVar

from regraft import CallFailed
from regraft.services.bt_executor.adaptation.results import Result
from regraft.services.bt_executor.leaves.context import Asked, LeafContext

A = TypeVar("A")
T = TypeVar("T")

Turns = Generator[Asked[Any], None, T]
"""Yields each request under way, is resumed when that is done, and returns what came of all."""

AttemptSteps = Turns[Result | None]
"""One attempt to adapt; None if nothing was to be done."""

MIN_PATIENCE: Final = 0.001
"""Seconds for the last of several requests where those before it took nearly all the time."""


class Asker:
    """Asks services one after the other, within one bound of time for all."""

    def __init__(self, context: LeafContext, now: float, patience: float) -> None:
        """Wait ``patience`` seconds altogether, from ``now`` on."""
        self._context = context
        self._until = now + patience

    def ask(self, service: str, request: object, reply: type[A], now: float) -> Turns[A]:
        """Ask a service; returns its answer, or raises CallFailed."""
        asked = self._context.call(service, request, reply, timeout=max(self._until - now, MIN_PATIENCE))
        try:
            yield asked
        finally:
            asked.give_up()
        if asked.error is not None:
            raise asked.error
        if asked.answer is None:
            raise CallFailed(service, None, "the answer was lost")
        return asked.answer
