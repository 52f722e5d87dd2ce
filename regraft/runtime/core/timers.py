"""Periodic calls and sleepers."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

from regraft.component.future import Future
from regraft.component.handlers import NEVER


@dataclass(slots=True)
class Timer:
    """A method that is called every ``period`` nanoseconds, next at ``due``."""

    name: str
    call: Callable[[], object]
    period: int
    due: int


@dataclass(slots=True)
class Timers:
    """The timers and sleepers of one component, in nanoseconds of its clock."""

    periodic: list[Timer] = field(default_factory=list)
    sleepers: list[tuple[int, int, Future[None]]] = field(default_factory=list)
    _count: itertools.count[int] = field(default_factory=itertools.count)

    def start(self, name: str, call: Callable[[], object], period: int, now: int) -> None:
        """Call ``call`` every ``period`` from one period after ``now``."""
        self.periodic.append(Timer(name, call, period, now + period))

    def retime(self, name: str, period: int, now: int) -> None:
        """Give a timer another period, counted from ``now``."""
        for timer in self.periodic:
            if timer.name == name and timer.period != period:
                timer.period, timer.due = period, now + period

    def stop_all(self) -> None:
        """Stop the periodic calls."""
        self.periodic.clear()

    def is_running(self, timer: Timer) -> bool:
        """Return whether a timer has not been stopped."""
        return any(other is timer for other in self.periodic)

    def sleep_until(self, then: int) -> Future[None]:
        """Return what is resolved when the clock reaches ``then``, or soon if that is past."""
        waiting: Future[None] = Future()
        # Members report when something is due next, and no such time is before zero or that far away.
        heapq.heappush(self.sleepers, (min(max(then, 0), NEVER), next(self._count), waiting))
        return waiting

    @property
    def in_use(self) -> bool:
        """Whether there is anything that can be due."""
        return bool(self.periodic or self.sleepers)

    def next_due(self) -> int | None:
        """Return when something is due next, None if never."""
        while self.sleepers and self.sleepers[0][2].abandoned:
            heapq.heappop(self.sleepers)
        due = [timer.due for timer in self.periodic]
        if self.sleepers:
            due.append(self.sleepers[0][0])
        return min(due) if due else None

    def take_due(self, now: int) -> list[Timer]:
        """Return the timers that are due, in order of declaration, and set them to their next time.

        A timer that is late by several periods is called once: ticks are never made up for in a burst.
        """
        due = [timer for timer in self.periodic if timer.due <= now]
        for timer in due:
            timer.due += timer.period * ((now - timer.due) // timer.period + 1)
        return due

    def wake_sleepers(self, now: int) -> None:
        """Resolve the sleepers that are due, by time and then by creation."""
        while self.sleepers and self.sleepers[0][0] <= now:
            heapq.heappop(self.sleepers)[2].resolve(None)
