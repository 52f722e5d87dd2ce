"""How well the present option has done: the mean of its utility over time, for the strategy that chose it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from regraft.bus_schema.annotations import PlainValue
from regraft.services.bt_executor.adaptation.port_values.durations import AT_ONCE


@dataclass(slots=True)
class UtilityMeter:
    """Averages utility from the time on at which a choice shows its effect.

    A sample holds until the next one; spans without data weigh nothing. Times are seconds of the tree's clock.

    Attributes:
        ticket: The planner's name of the choice; empty while there is nothing to measure.
        since: When the effect of the choice can be seen.
    """

    ticket: str = ""
    since: float = math.inf
    _first: float = math.nan
    _last: float = math.nan
    _held: float | None = None
    _area: float = 0.0
    _span: float = 0.0
    _sum: float = 0.0
    _count: int = 0

    def sample(self, now: float, utility: float | None) -> None:
        """Take a sample; None while it is not known. Samples that come too early do not count."""
        if not self.ticket or now < self.since - AT_ONCE:
            return
        self.pause(now)
        if utility is None or not math.isfinite(utility):
            return
        if self._count == 0:
            self._first = max(now, self.since)
        self._last = now
        self._held = utility
        self._sum += utility
        self._count += 1

    def pause(self, now: float) -> None:
        """Stop holding the last sample: nothing is measured from now on until the next."""
        if self._held is not None:
            span = now - self._last
            self._area += self._held * span
            self._span += span
            self._last = now
            self._held = None

    def credit(self) -> dict[str, PlainValue] | None:
        """Return what the choice has earned, None if nothing was measured."""
        if self._count == 0:
            return None
        mean = self._area / self._span if self._span > 0 else self._sum / self._count
        return {"ticket": self.ticket, "utility": mean, "from": self._first, "to": self._last}
