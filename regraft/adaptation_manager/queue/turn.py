"""One at a time: each change or reading of the whole system has a slot of its own, under either clock."""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from regraft import ExclusiveSlot, Future

if TYPE_CHECKING:
    from regraft import Kit


class Turn:
    """``async with turn.taken() as slot``; under the real clock, slots alone keep nobody apart."""

    def __init__(self, kit: Kit) -> None:
        self._kit = kit
        self._is_taken = False
        self._waiting: deque[Future[None]] = deque()

    @asynccontextmanager
    async def taken(self) -> AsyncIterator[ExclusiveSlot]:
        """Hold a slot that nobody else in this component uses meanwhile."""
        async with self._kit.exclusive() as slot:
            while self._is_taken:
                waiting: Future[None] = Future()
                self._waiting.append(waiting)
                await waiting
            self._is_taken = True
            try:
                yield slot
            finally:
                self._is_taken = False
                while self._waiting:
                    self._waiting.popleft().resolve(None)
