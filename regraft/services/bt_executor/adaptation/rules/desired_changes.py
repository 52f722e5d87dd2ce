"""The requests of a plan, and the changes that they come to in the architecture as it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import Change, Connect, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.modes.modes import as_needed

_DIGITS: Final = 12
"""Significant digits that steps keep, so that 0.26 - 0.08 is 0.18."""


class Impossible(Exception):
    """A step that cannot be computed: no such component or parameter, or it holds no number."""


@dataclass(frozen=True, slots=True)
class Step:
    """Change a number by so much from its value at the request, kept within ``low`` and ``high``."""

    component: str
    parameter: str
    by: float
    low: float = -math.inf
    high: float = math.inf


DesiredChange = Change | Step
"""A change, or a step from the present value."""


def current_value(architecture: Architecture, component: str, parameter: str) -> PlainValue:
    """Return what a parameter should be in an architecture.

    Raises:
        Impossible: there is no such component or parameter.
    """
    spec = architecture.components.get(component)
    if spec is None:
        raise Impossible(
            f"there is no component '{component}'; there are: {', '.join(sorted(architecture.components))}"
        )
    if parameter in spec.parameters:
        return spec.parameters[parameter]
    described = spec.description.parameter(parameter) if spec.description else None
    if described is None:
        names = [each.name for each in spec.description.parameters] if spec.description else sorted(spec.parameters)
        raise Impossible(f"{component} has no parameter '{parameter}'; it has: {', '.join(names) or 'none'}")
    return described.default


def resolved(desired: Sequence[DesiredChange], architecture: Architecture) -> tuple[Change, ...]:
    """Return the changes that desired changes come to, without those that would change nothing.

    Requests for parameters of one component become one change. A transition names the state to be reached, as in modes.

    Raises:
        Impossible: a step cannot be computed.
    """
    changes: list[Change] = []
    values: dict[str, dict[str, PlainValue]] = {}
    for change in desired:
        if isinstance(change, Step | SetParameters):
            if change.component not in values:
                values[change.component] = {}
                changes.append(SetParameters(change.component, values[change.component]))
            values[change.component] |= _values(change, values[change.component], architecture)
        else:
            changes.append(change)
    for component, wanted in values.items():
        for name in [name for name, value in wanted.items() if _is(architecture, component, name, value)]:
            del wanted[name]
    return as_needed([change for change in changes if not _holds(change, architecture)], architecture)


def _values(
    change: Step | SetParameters, wanted: dict[str, PlainValue], architecture: Architecture
) -> dict[str, PlainValue]:
    if isinstance(change, SetParameters):
        return {name: _fitted(architecture, change.component, name, value) for name, value in change.parameters.items()}
    name = change.parameter
    now = wanted[name] if name in wanted else current_value(architecture, change.component, name)
    if isinstance(now, bool) or not isinstance(now, int | float):
        raise Impossible(f"{change.component}.{name} is {now!r}, not a number that can be changed by {change.by:g}")
    value = clamped(now + change.by, change.low, change.high)
    if not math.isfinite(value):
        raise Impossible(f"{change.component}.{name} cannot become {value}")
    return {name: _fitted(architecture, change.component, name, value)}


def clamped(value: float, low: float, high: float) -> float:
    """Return a number kept within bounds, without the noise of binary fractions."""
    return min(max(float(f"{value:.{_DIGITS}g}"), low), high)


def _fitted(architecture: Architecture, component: str, name: str, value: PlainValue) -> PlainValue:
    """Return a number as the parameter's own kind of number: scripts calculate in reals."""
    try:
        now = current_value(architecture, component, name)
    except Impossible:
        return value
    if isinstance(value, float) and type(now) is int and value.is_integer():
        return int(value)
    if isinstance(value, float) and type(now) is bool and value in (0.0, 1.0):
        return bool(value)
    return float(value) if type(value) is int and isinstance(now, float) else value


def _is(architecture: Architecture, component: str, name: str, value: PlainValue) -> bool:
    try:
        now = current_value(architecture, component, name)
    except Impossible:
        return False
    return type(now) is type(value) and now == value


def _holds(change: Change, architecture: Architecture) -> bool:
    """Return whether values or a connection are in force already."""
    spec = architecture.components.get(change.component)
    if isinstance(change, SetParameters):
        return not change.parameters and spec is not None
    if spec is not None and isinstance(change, Connect):
        return spec.connections.get(change.port, "") == change.topic
    return False
