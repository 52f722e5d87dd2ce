"""The values of the names in conditions, as they are now; a name that is not known has none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.management.system import (
    SystemFaultKind,
    SystemFaults,
    SystemMeasurements,
    SystemQualities,
    SystemStates,
)
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.modes.mode_conditions import GONE, ConditionName, NameKind, values_of_modes

Names = Mapping[str, ConditionName]


def values_of(
    names: Names,
    states: SystemStates | None,
    faults: SystemFaults | None,
    requirements: SystemQualities | None,
    modes: SystemModes,
) -> dict[str, Any]:
    """Return the values of all names but those of components' qualities."""
    found: dict[str, Any] = dict(
        values_of_modes(
            names, {part.part: part.target for part in modes.parts}, {part.part: part.actual for part in modes.parts}
        )
    )
    for name, known in names.items():
        if known.kind is NameKind.REQUIREMENT:
            value = _requirement(known, requirements)
        else:
            value = _of_component(known, states, faults)
        if value is not None:
            found[name] = value
    return found


def _of_component(known: ConditionName, states: SystemStates | None, faults: SystemFaults | None) -> Any:
    if known.kind is NameKind.FAILED:
        if faults is None:
            return None
        return any(each.component == known.owner and each.kind is not SystemFaultKind.RAISED for each in faults.present)
    if known.kind not in (NameKind.STATE, NameKind.ACTIVE) or states is None:
        return None
    state = next((each for each in states.components if each.component == known.owner), None)
    if state is None:
        return None
    if known.kind is NameKind.ACTIVE:
        return state.state is State.ACTIVE
    return state.state.value if state.state else GONE


def _requirement(known: ConditionName, requirements: SystemQualities | None) -> Any:
    qualities = requirements.qualities if requirements else ()
    found = next((each for each in qualities if each.requirement == known.owner), None)
    return getattr(found, known.field) if found is not None and found.active else None


def measured_values(
    names: Names, states: SystemStates | None, measurements: SystemMeasurements | None, now: float
) -> dict[str, float]:
    """Return the qualities of components that count, by name; only the present run of a component has any."""
    runs = {each.component: each.incarnation for each in (states.components if states else ()) if each.state}
    found = {}
    for name, known in names.items():
        latest = measurements.of(known.owner) if measurements and known.kind is NameKind.QUALITY else None
        if latest is None or latest.incarnation != runs.get(known.owner) or latest.is_late(now):
            continue
        if known.field in latest.values:
            found[name] = latest.values[known.field]
    return found
