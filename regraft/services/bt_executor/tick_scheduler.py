"""Ticks of the tree between its periodic ones."""

from __future__ import annotations

from collections.abc import Callable

from regraft import Future, Kit, Task

MIN_WAIT = 0.001
"""Seconds; a timer of the tree that is due within this time does not get a tick earlier."""


class TickScheduler:
    """Has the tree ticked when a leaf's answer has come, and when a timer of the tree comes due."""

    def __init__(self, kit: Kit, tick: Callable[[], None]) -> None:
        """Schedule calls of ``tick``."""
        self._kit = kit
        self._tick = tick
        self._wanted: Future[None] = Future()
        self._alarm: Task | None = None
        self._alarm_at = 0.0

    def begin(self) -> None:
        """Tick on demand from now on, as long as the component is active."""
        self._wanted = Future()
        self._alarm = None
        self._kit.spawn(self._tick_on_demand(), "ticks on demand")

    def soon(self) -> None:
        """Have the tree ticked when what is being handled now is done."""
        self._wanted.resolve(None)

    def at(self, due: float | None) -> None:
        """Have the tree ticked at a time in seconds, if that is earlier than what is scheduled."""
        now = self._kit.now()
        # A node that is due now has just been ticked: a loop without end waits for the next periodic tick.
        if due is None or due <= now or (self._alarm and self._alarm_at <= due):
            return
        if self._alarm:
            self._alarm.cancel()
        self._alarm_at = due
        self._alarm = self._kit.spawn(self._ring(due - now), "timer of the tree")

    async def _tick_on_demand(self) -> None:
        while True:
            await self._wanted
            self._wanted = Future()
            self._tick()

    async def _ring(self, seconds: float) -> None:
        await self._kit.sleep(max(MIN_WAIT, seconds))
        self._alarm = None
        self._tick()
