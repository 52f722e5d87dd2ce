"""Which mode a part is in, inferred from how its components are: exactly equal, no ranges.

The rules are those of ROS 2's system_modes, with two differences. A component that has failed is in no mode that wants
it to do more. Modes may have all parts inactive.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from regraft.bus_schema.annotations import Connections, PlainValue
from regraft.bus_schema.model.adaptation import Change
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State, is_lower
from regraft.bus_schema.model.modes.mode_parts import DEFAULT
from regraft.bus_schema.model.modes.modes import is_in_force

UNKNOWN = "unknown"
"""The state of a part of which nothing is known, or whose components are in different ones."""


def as_read(
    spec: ComponentSpec, state: State, parameters: Mapping[str, PlainValue], connections: Connections
) -> ComponentSpec:
    """Return a spec with what was read back. A component that is not configured has no connections to read."""
    wired = spec.connections if state in (State.UNCONFIGURED, State.FINALIZED) else connections
    return replace(spec, state=state, parameters={**spec.parameters, **parameters}, connections=dict(wired))


def actual_mode(
    modes: Mapping[str, Sequence[Change]], asked: str, wanted: Architecture, actual: Architecture
) -> tuple[str, tuple[str, ...]]:
    """Return the mode that a part is in, empty for none, and all that would do.

    Of several that would do it is the one that was asked for, else the default, else the first.
    """
    fitting = tuple(name for name, changes in modes.items() if _holds(changes, wanted, actual))
    default = next((name for name in fitting if name.rpartition("/")[2].rpartition(".")[2] == DEFAULT), "")
    if asked in fitting:
        return asked, fitting
    return default or (fitting[0] if fitting else ""), fitting


def _holds(changes: Sequence[Change], wanted: Architecture, actual: Architecture) -> bool:
    if not is_in_force(changes, actual):
        return False
    moved = {change.component for change in changes if change.change == "transition"}
    return not any(_has_failed(change.component, wanted, actual) for change in changes if change.component not in moved)


def _has_failed(component: str, wanted: Architecture, actual: Architecture) -> bool:
    spec, live = wanted.components.get(component), actual.components.get(component)
    return spec is not None and live is not None and is_lower(live.state, spec.state)


def state_of_many(states: Iterable[str], *, asked: str, actual: str) -> str:
    """Return the state of a part that has several components, in states by name (system_modes, ``infer``)."""
    found = set(states)
    if State.ERROR_PROCESSING.value in found:
        return State.ERROR_PROCESSING.value
    if asked:
        return State.ACTIVE.value if actual == asked else State.ACTIVATING.value
    return found.pop() if len(found) == 1 else UNKNOWN
