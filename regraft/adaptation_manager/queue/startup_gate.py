"""Where requests wait until the manager has taken over."""

from __future__ import annotations

from regraft import Future, RefusalCode, RequestRefused

RETRY_AFTER = 0.5


class StartupGate:
    """Closed at first, then open."""

    def __init__(self) -> None:
        self.is_open = False
        self._waiting: list[Future[None]] = []

    async def passed(self, most_waiting: int) -> None:
        """Wait until it is open; raises RequestRefused if too many do."""
        if self.is_open:
            return
        if len(self._waiting) >= most_waiting:
            why = "the adaptation manager has not taken over yet, and many wait for it already"
            raise RequestRefused(why, RefusalCode.STARTING, retry_after=RETRY_AFTER)
        waiting: Future[None] = Future()
        self._waiting.append(waiting)
        await waiting

    def open(self) -> None:
        """Let all pass from now on."""
        self.is_open = True
        waiters, self._waiting = self._waiting, []
        for waiting in waiters:
            waiting.resolve(None)
