"""The values of the names in conditions, as they are now; a name that is not known has none."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.management.system import (
    SystemFaultKind,
    SystemFaults,
    SystemMeasurements,
    SystemQualities,
    SystemStates,
)
from regraft.bus_schema.model.adaptation import ChangeState
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.model.lifecycle import DOWNWARD, PRIMARY, State, Transition, is_lower
from regraft.bus_schema.model.modes.mode_conditions import GONE, ConditionName, NameKind, values_of_modes

Names = Mapping[str, ConditionName]


def values_of(
    names: Names,
    states: SystemStates | None,
    faults: SystemFaults | None,
    requirements: SystemQualities | None,
    modes: SystemModes,
    measured: Values,
) -> Values:
    """Return the values of all names; ``measured`` are those of components' qualities."""
    found: dict[str, Any] = dict(
        values_of_modes(
            names, {part.part: part.target for part in modes.parts}, {part.part: part.actual for part in modes.parts}
        )
    )
    why: dict[str, str] = {}
    for name, known in names.items():
        if known.kind is NameKind.REQUIREMENT:
            value, why[name] = _requirement(known, requirements)
        else:
            value = _of_component(known, states, faults)
        if value is not None:
            found[name] = value
    return Values({**found, **measured}, {**why, **measured.why})


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


def fallen_out(
    wanted: Mapping[str, Collection[str]],
    architecture: Architecture,
    states: SystemStates | None,
    faults: SystemFaults | None,
) -> list[str]:
    """Return the modes of which a component does less than it should, and has not failed: nobody has brought it back.

    ``wanted`` are the components that each mode configures or activates.
    """
    if states is None or faults is None:
        return []
    failed = {each.component for each in faults.present if each.kind is not SystemFaultKind.RAISED}

    def has_fallen(name: str) -> bool:
        spec, state = architecture.components.get(name), states.state_of(name)
        if spec is None or state not in PRIMARY or name in failed:
            return False
        return is_lower(state, spec.state)

    return [mode for mode, components in wanted.items() if any(map(has_fallen, components))]


def wanted_by(modes: Iterable[str], architecture: Architecture) -> dict[str, tuple[str, ...]]:
    """Return the components that each mode configures or activates."""
    return {
        mode: tuple(
            change["component"]
            for change in architecture.modes[mode]
            if change["change"] == ChangeState.change and Transition(change["transition"]) not in DOWNWARD
        )
        for mode in modes
        if mode in architecture.modes
    }


def _requirement(known: ConditionName, requirements: SystemQualities | None) -> tuple[Any, str]:
    """Return the value of a requirement's field, None if it is not known, and why."""
    qualities = requirements.qualities if requirements else ()
    found = next((each for each in qualities if each.requirement == known.owner), None)
    if found is None:
        return None, "the requirement was never reported"
    return (getattr(found, known.field), "not measured") if found.active else (None, "the requirement is not active")


class Values(dict[str, Any]):
    """The values of names; those without one are unknown, for the reasons in ``why`` as far as there are any."""

    def __init__(self, values: Mapping[str, Any], why: Mapping[str, str]) -> None:
        super().__init__(values)
        self.why = why

    def __missing__(self, name: str) -> Any:
        why = self.why.get(name, "")
        raise Unknown(f"{name} is not known" + (f": {why}" if why else ""))


def measured_values(
    names: Names, states: SystemStates | None, measurements: SystemMeasurements | None, now: float
) -> Values:
    """Return the qualities of components that count, by name; only the present run of a component has any."""
    runs = {each.component: each.incarnation for each in (states.components if states else ()) if each.state}
    values: dict[str, float] = {}
    why: dict[str, str] = {}
    for name, known in names.items():
        if known.kind is NameKind.QUALITY:
            latest = measurements.of(known.owner) if measurements else None
            if known.owner not in runs:
                why[name] = f"{known.owner} has no run"
            elif latest is None or latest.incarnation != runs[known.owner]:
                why[name] = "not measured yet"
            elif unknown := latest.why_unknown(known.field, now):
                why[name] = unknown
            else:
                values[name] = latest.values[known.field]
    return Values(values, why)
