"""The qualities that running components measure of themselves."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus_schema.annotations import Count, Seconds
from regraft.bus_schema.encoding.registry import message

LATE_PERIODS = 3.0
"""Periods after which what was measured last is too old to count."""
SILENT_PERIODS = 10.0
"""Periods after which silence is a fault."""


@message("regraft/MeasuredQualities")
@dataclass(frozen=True, slots=True)
class MeasuredQualities:
    """The qualities of one component, as its ``evaluate`` gave them at ``stamp``.

    Each quality that its class measures is in ``values`` or, with the reason, in ``unknown``. The next ones come a
    ``period`` later. Under simulated time, ``stamp`` is the first tick at or after a whole multiple of the period.
    """

    stamp: Seconds
    component: str
    incarnation: Count
    period: Seconds
    values: dict[str, float] = field(default_factory=dict)
    unknown: dict[str, str] = field(default_factory=dict)

    def is_late(self, now: float) -> bool:
        """Return whether newer ones should have come, ``now`` being on the component's clock."""
        return now - self.stamp > LATE_PERIODS * self.period

    def why_unknown(self, quality: str, now: float) -> str:
        """Return why a quality does not count at ``now``, on the component's clock; empty if it does."""
        if self.is_late(now):
            return f"late: measured at {self.stamp:g} s, and not every {self.period:g} s since"
        if quality in self.values:
            return ""
        return self.unknown.get(quality, f"{self.component} measures no {quality!r}")
