"""Adaptations that wait for their turn: first come, first served, bounded."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from regraft import Future
from regraft.adaptation_manager.phases import Phases
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Violation

Prepare = Callable[[AdaptationRequest], tuple[AdaptationRequest, tuple[Violation, ...]]]


@dataclass(eq=False, slots=True)
class Entry:
    """One adaptation in the queue or under way, asked for by ``source``. ``number`` is 0 while it has none.

    ``prepare`` completes the request when its turn comes: an undo knows its changes only then. ``shown`` is its
    report once it no longer just waits; ``confirmed`` if somebody wants it to be final at once.
    """

    number: int
    request: AdaptationRequest
    prepare: Prepare | None = None
    source: str = ""
    cancelled: bool = False
    confirmed: bool = False
    shown: AdaptationReport | None = None
    phases: Phases = field(default_factory=Phases)
    began: float = 0.0
    report: AdaptationReport | None = None
    _waiters: list[Future[AdaptationReport]] = field(default_factory=list)

    def lasted(self) -> float:
        """Return the wall-clock seconds since its turn came."""
        return time.monotonic() - self.began

    def ended(self) -> Future[AdaptationReport]:
        """Return what its end resolves, to be awaited by one task."""
        waiting: Future[AdaptationReport] = Future()
        if self.report is not None:
            waiting.resolve(self.report)
        else:
            self._waiters.append(waiting)
        return waiting

    def end(self, report: AdaptationReport) -> None:
        """Notify all who wait how it ended."""
        self.report = report
        for waiting in self._waiters:
            waiting.resolve(report)
        self._waiters.clear()


class AdaptationQueue:
    """The waiting requests, and the one being served."""

    def __init__(self) -> None:
        """Start empty."""
        self.serving: Entry | None = None
        self.waiting: deque[Entry] = deque()
        self._idle: Future[None] | None = None

    def enqueue(self, entry: Entry) -> None:
        """Put an entry at the end of the queue."""
        self.waiting.append(entry)
        if self._idle is not None:
            self._idle.resolve(None)

    async def next(self) -> Entry:
        """Wait for the next entry, and serve it."""
        self.serving = None
        while not self.waiting:
            self._idle = Future()
            await self._idle
        self.serving = self.waiting.popleft()
        return self.serving

    def entries(self) -> list[Entry]:
        """Return who is being served, and who waits."""
        return [*([self.serving] if self.serving else []), *self.waiting]
