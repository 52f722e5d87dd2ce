"""The qualities that components measure after a moment: earlier measurements do not count."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus_schema.messages.management.qualities import LATE_PERIODS, MeasuredQualities
from regraft.bus_schema.model.expressions import Unknown

LOOK_INTERVAL = 0.1
"""Seconds of the component's clock between two looks at an adaptation that is being confirmed."""


@dataclass(slots=True)
class _Latest:
    """The latest measurement of a component, and when that was first seen; ``old`` if it is from before the moment."""

    qualities: MeasuredQualities
    seen: float
    old: bool


@dataclass(slots=True)
class MeasuredSince:
    """Takes what is asked of components. It compares no two clocks: ``now`` is always the manager's."""

    _latest: dict[str, _Latest] = field(default_factory=dict)
    _failures: dict[str, str] = field(default_factory=dict)

    def take(self, component: str, found: MeasuredQualities | str, now: float, *, old: bool = False) -> None:
        """Take what a component has measured last, or why it cannot be asked; ``old`` before the moment."""
        if isinstance(found, str):
            self._failures[component] = found
            return
        self._failures.pop(component, None)
        before = self._latest.get(component)
        if old or before is None or _run(before.qualities) != _run(found):
            self._latest[component] = _Latest(found, now, old)

    def value(self, component: str, quality: str, now: float) -> float:
        """Return a quality; raises Unknown."""
        name, latest = f"{component}.{quality}", self._latest.get(component)
        if component in self._failures:
            raise Unknown(f"{name} is unknown: {self._failures[component]}")
        if latest is None or latest.old:
            raise Unknown(f"{name} is unknown: not measured since")
        if now - latest.seen > LATE_PERIODS * latest.qualities.period + LOOK_INTERVAL:
            raise Unknown(f"{name} is unknown: late")
        found = latest.qualities.values.get(quality)
        if found is None:
            raise Unknown(f"{name} is unknown: {latest.qualities.unknown.get(quality, 'not measured')}")
        return found


def _run(qualities: MeasuredQualities) -> tuple[int, float]:
    return qualities.incarnation, qualities.stamp
