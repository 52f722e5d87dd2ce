"""How often messages come."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from regraft.cli.bus.gaps import Gaps
from regraft.cli.terminal.output import say, seconds
from regraft.client import TopicSample

WINDOW = 10_000
"""Messages that rates are taken over, the newest ones."""
REPORT_INTERVAL = 1.0
"""Seconds between two lines while messages come."""


@dataclass(slots=True)
class Rates:
    """Arrival times and stamps of the newest messages, and how many were missing."""

    arrivals: deque[float] = field(default_factory=lambda: deque(maxlen=WINDOW))
    stamps: deque[float] = field(default_factory=lambda: deque(maxlen=WINDOW))
    count: int = 0
    missing: int = 0
    size: int = 0
    _gaps: Gaps = field(default_factory=Gaps)

    def add(self, now: float, sample: TopicSample) -> None:
        """Count a message that arrived ``now`` (monotonic seconds)."""
        self.arrivals.append(now)
        self.stamps.append(sample.stamp / 1e9)
        self.count += 1
        self.size += sample.size
        self.missing += self._gaps.before(sample)

    def plain(self) -> dict[str, float | int | None]:
        """Return the rates in Hz, by the wall clock and by stamps; None while there are too few messages."""
        gaps = [after - before for before, after in zip(self.arrivals, list(self.arrivals)[1:], strict=False)]
        return {
            "count": self.count,
            "hz": rate(self.arrivals),
            "stamp_hz": rate(self.stamps),
            "gap_mean_s": statistics.fmean(gaps) if gaps else None,
            "gap_max_s": max(gaps, default=None),
            "missing": self.missing,
            "bytes_mean": self.size / self.count if self.count else None,
        }

    def line(self) -> str:
        """Return the rates as one line."""
        plain = self.plain()
        if plain["hz"] is None:
            return f"{self.count} messages, too few for a rate"
        stamped = f"{plain['stamp_hz']:.2f} Hz by their stamps" if plain["stamp_hz"] else "stamps do not change"
        gap = seconds(plain["gap_max_s"] or 0.0)
        text = f"{plain['hz']:.2f} Hz, {stamped}, longest gap {gap}, {self.count} messages"
        return f"{text}, {self.missing} missing" if self.missing else text


def rate(times: deque[float]) -> float | None:
    """Return how often something happened per second, None if that is unknown.

    >>> rate(deque([0.0, 0.5, 1.0]))
    2.0
    """
    if len(times) < 2 or times[-1] <= times[0]:
        return None
    return (len(times) - 1) / (times[-1] - times[0])


def rates_of(samples: Iterable[TopicSample], *, shown: bool) -> Rates:
    """Return how often samples come, also if Ctrl-C ends it; with ``shown``, a line is printed now and then."""
    rates, shown_at = Rates(), time.monotonic()
    try:
        for sample in samples:
            rates.add(time.monotonic(), sample)
            if shown and time.monotonic() - shown_at >= REPORT_INTERVAL:
                shown_at = time.monotonic()
                say(rates.line())
    except KeyboardInterrupt:
        if not rates.count:
            raise
    return rates
