"""Which of the qualities go out to the bus: only those that have changed, and not too often."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from regraft.bus_schema.messages.quality import Quality

MIN_SECONDS: Final = 0.2
"""Seconds of the tree's time between two messages of a requirement of which only the numbers or words change."""
_NEARLY: Final = 1e-6
EPSILON: Final = 1e-3
"""The relative change of a metric from which on it is one."""
MAX_REMEMBERED: Final = 1000


class QualityPublisher:
    """Passes on what has changed.

    At once: whether it is satisfied, active, known, and how much it weighs. Numbers and words follow after a while; the
    last metric of a run never gets lost, because the requirement is not active any more then.
    """

    def __init__(self, put: Callable[[Quality], None]) -> None:
        """Have ``put`` called with what goes out."""
        self._put = put
        self._last: dict[str, Quality] = {}

    def tell(self, quality: Quality) -> None:
        """Take the latest of a requirement."""
        last = self._last.get(quality.requirement)
        if last is None and not quality.active:
            return
        if last is None or _decides(last) != _decides(quality) or self._has_drifted(last, quality):
            if len(self._last) >= MAX_REMEMBERED:
                self._last.clear()
            self._last[quality.requirement] = quality
            self._put(quality)

    @staticmethod
    def _has_drifted(last: Quality, quality: Quality) -> bool:
        if 0.0 <= quality.stamp - last.stamp < MIN_SECONDS - _NEARLY:
            return False
        return last.status != quality.status or _differ(last.metric, quality.metric)


def _decides(quality: Quality) -> tuple[object, ...]:
    return quality.node, quality.attribute, quality.satisfied, quality.active, quality.metric is None, quality.weight


def _differ(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is not other
    return abs(one - other) > EPSILON * max(abs(one), abs(other))
