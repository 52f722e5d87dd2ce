"""A bound on the calls of one asynchronous handler that overlap: what comes faster than it ends would pile up."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from regraft.runtime.core.tasks import RunningTask, Tasks

MAX_OVERLAPPING = 1000
"""Calls of one asynchronous handler or timer that may be under way at once."""

Done = Callable[[], None]


class Overlap:
    """Starts a coroutine for each call of one handler or timer, while there is room for it."""

    def __init__(
        self,
        method: Callable[..., Coroutine[Any, Any, Any]],
        spawn: Callable[[Coroutine[Any, Any, Any], Done], RunningTask],
        left_out: Callable[[], None],
        tasks: Tasks,
    ) -> None:
        """``spawn`` runs a coroutine as one of ``tasks``, and calls what else it is given at its end.

        ``left_out`` is called where there is no room.
        """
        self._method = method
        self._spawn = spawn
        self._left_out = left_out
        self._tasks = tasks
        self._under_way = 0

    def call(self, *arguments: Any) -> None:
        """Begin a call, or leave it out."""
        if self._under_way >= MAX_OVERLAPPING:
            self._left_out()
            return
        self._under_way += 1
        self._tasks.full += self._under_way == MAX_OVERLAPPING
        self._spawn(self._method(*arguments), self._ended)

    def _ended(self) -> None:
        self._tasks.full -= self._under_way == MAX_OVERLAPPING
        self._under_way -= 1
