"""The report of a run in lockstep: time, pace, members, and whether the run is reproducible."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field

from regraft.bus_schema.messages.protocol.clock import CauseCode, ClockTime, RunCause
from regraft.lockstep.clock_publisher import ClockPublisher

TELL_INTERVAL = 0.25
"""Seconds of wall-clock time between two reports."""
MAX_CAUSES = 10
"""Causes that are kept: what goes wrong first has the others follow."""


@dataclass(slots=True)
class RunReport:
    """The report of one run of the time source, put at ``key`` now and then.

    ``speed`` is simulated time over wall-clock time. ``wall`` is the wall-clock seconds since the first tick of the
    run's first incarnation, those with a dead source included.
    """

    publisher: ClockPublisher
    key: str
    causes: list[RunCause] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)
    speed: float = 0.0
    wall: float = 0.0
    _next: float = 0.0

    @property
    def reproducible(self) -> bool:
        """Whether nothing has happened that an equal run would not repeat."""
        return not self.causes

    def note(self, code: CauseCode, component: str, now: int, text: str) -> None:
        """Note why the run is not repeatable, at a simulated time (nanoseconds)."""
        if len(self.causes) < MAX_CAUSES:
            self.causes.append(RunCause(code, component, now / 1e9, text))

    def tell(
        self, tick: int, now: int, members: Iterable[str], waiting: tuple[str, ...] = (), *, finished: bool = False
    ) -> None:
        """Put the report if it is time; the one of a finished run always."""
        wall = time.monotonic()
        if wall < self._next and not finished:
            return
        self._next = wall + TELL_INTERVAL
        told = ClockTime(
            tick,
            now,
            self.speed,
            tuple(sorted(members)),
            waiting,
            self.reproducible,
            tuple(self.dropped),
            finished,
            self.wall,
            tuple(self.causes),
        )
        self.publisher.put(self.key, told)
