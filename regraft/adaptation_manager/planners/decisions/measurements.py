"""The qualities of components that a decision is measured by: known, or unknown and why."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from regraft import Kit
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.situation import MEASUREMENTS
from regraft.bus_schema.messages.management.system import SystemMeasurements
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.model.robots.scoped_changes import Names


@dataclass(frozen=True, slots=True)
class Measurement:
    """A quality of a component and when it was measured, or why it is unknown.

    ``declared`` is false where the component measures no such quality at all.
    """

    value: float | None = None
    stamp: float | None = None
    why: str = ""
    declared: bool = True


class Measurements(Mapping[str, float]):
    """Measured qualities by the names that a decision has for them."""

    def __init__(self, found: Mapping[str, Measurement] | None = None, since: float = -math.inf) -> None:
        """Have what was measured later than ``since``: before it, something else stood."""
        self.found = {name: _later(each, since) for name, each in (found or {}).items()}

    def __getitem__(self, name: str) -> float:
        """Return a value; raises KeyError for a name that is no measured quality, and Unknown."""
        measurement = self.found[name]
        if measurement.value is None:
            raise Unknown(f"{name} is not measured: {measurement.why}")
        return measurement.value

    def __iter__(self) -> Iterator[str]:
        return iter(self.found)

    def __len__(self) -> int:
        return len(self.found)

    def known(self) -> dict[str, float]:
        """Return the values that are known."""
        return {name: each.value for name, each in self.found.items() if each.value is not None}


class MeasuredSituation(dict[str, Any]):
    """A decision's context with what is measured; a lookup raises KeyError, or Unknown with the reason."""

    def __init__(self, situation: Mapping[str, Any], measurements: Measurements) -> None:
        super().__init__(situation)
        self._measurements = measurements

    def __missing__(self, name: str) -> float:
        """Look a measured quality up."""
        return self._measurements[name]


def _later(measurement: Measurement, since: float) -> Measurement:
    if measurement.stamp is None or measurement.value is None or measurement.stamp > since:
        return measurement
    return Measurement(None, measurement.stamp, f"not measured since {since:g} s, when the last change showed effect")


def measurements_for(decision: Decision, kit: Kit, since: float = -math.inf) -> Measurements:
    """Return the qualities that a decision is measured by, as their components measured them last."""
    names = Names(kit.scope)
    message = kit.inputs[MEASUREMENTS].latest if MEASUREMENTS in kit.inputs else None
    found = {}
    for name in decision.measured_names():
        component, _, quality = name.rpartition(".")
        found[name] = _measurement(message, names.component(component), quality, kit.now())
    return Measurements(found, since)


def _measurement(message: SystemMeasurements | None, component: str, quality: str, now: float) -> Measurement:
    latest = None if message is None else message.of(component)
    if latest is None:
        return Measurement(why=f"{component} is not active, or has measured nothing yet")
    why = latest.why_unknown(quality, now)
    declared = quality in latest.values or quality in latest.unknown
    return Measurement(None if why else latest.values[quality], latest.stamp, why, declared)
