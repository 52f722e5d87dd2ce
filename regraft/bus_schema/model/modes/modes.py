"""Entering a mode: its transitions name the state to be reached, from any present one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import Change, ChangeState, Connect, Move, SetParameters, Swap
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import DOWNWARD, State, Transition, after, is_at_most, route
from regraft.bus_schema.model.parameter_values import effective_parameter

GOALS = {
    Transition.CONFIGURE: (State.INACTIVE, State.ACTIVE),
    Transition.ACTIVATE: (State.ACTIVE,),
    Transition.DEACTIVATE: (State.INACTIVE, State.UNCONFIGURED),
    Transition.CLEANUP: (State.UNCONFIGURED,),
}
"""The state that a transition of a mode is to lead to, and others that will do."""


def as_needed(
    changes: Iterable[Change],
    architecture: Architecture,
    earlier: Iterable[Change] = (),
    found: Mapping[str, State] | None = None,
) -> tuple[Change, ...]:
    """Return the changes of a mode with the transitions that lead from how things are, after ``earlier`` changes.

    ``found`` has the states that components really are in. One that has failed is lower than it should be. Where a mode
    wants a component as it is already, its transition is kept if the architecture has to follow.
    """
    wanted = {name: spec.state for name, spec in architecture.components.items()}
    states = wanted | {name: state for name, state in (found or {}).items() if name in wanted}
    for change in earlier:
        if isinstance(change, ChangeState) and change.component in states:
            for known in (wanted, states):
                known[change.component] = after(known[change.component], change.transition) or known[change.component]
    needed: list[Change] = []
    for change in changes:
        goals = GOALS.get(change.transition) if isinstance(change, ChangeState) else None
        start = states.get(change.component)
        if not isinstance(change, ChangeState) or goals is None or start is None:
            needed.append(change)
        elif change.transition in DOWNWARD and is_at_most(start, goals[0]):
            if not is_at_most(wanted[change.component], goals[0]):
                needed.append(change)
                wanted[change.component] = goals[0]
        elif start not in goals:
            way = route(start, goals[0])
            needed += [ChangeState(change.component, step) for step in way] if way else [change]
            wanted[change.component] = states[change.component] = goals[0]
        elif change.transition not in DOWNWARD and wanted[change.component] not in goals:
            needed.append(change)
            wanted[change.component] = start
    return tuple(needed)


def is_in_force(changes: Iterable[Change], architecture: Architecture) -> bool:
    """Return whether all is as a mode wants it: the inference of modes (exactly equal, no ranges)."""
    return all(_is_so(change, architecture) for change in changes)


def _is_so(change: Change, architecture: Architecture) -> bool:
    spec = architecture.components.get(change.component)
    if change.change in ("add", "remove"):
        return (spec is not None) == (change.change == "add")
    if spec is None:
        return False
    if isinstance(change, SetParameters):
        return _has_values(spec, change.parameters)
    if isinstance(change, Connect):
        return _is_connected(spec, change.port, change.topic)
    if isinstance(change, Swap):
        wired = all(_is_connected(spec, port, topic) for port, topic in change.connections.items())
        return change.cls in ("", spec.cls) and wired and _has_values(spec, change.parameters)
    if isinstance(change, Move):
        return spec.host == change.host
    return isinstance(change, ChangeState) and spec.state in GOALS.get(change.transition, ())


def _is_connected(spec: ComponentSpec, port: str, topic: str | None) -> bool:
    return spec.connections.get(port, "") == topic


def _has_values(spec: ComponentSpec, values: Mapping[str, PlainValue]) -> bool:
    return all(_equal(_value(spec, name), value) for name, value in values.items())


def _value(spec: ComponentSpec, name: str) -> PlainValue:
    if spec.description is None:
        return spec.parameters.get(name)
    return effective_parameter(spec.description, spec.parameters, name)


def _equal(one: PlainValue, other: PlainValue) -> bool:
    """Compare exactly; Python counts ``True`` as 1."""
    return isinstance(one, bool) == isinstance(other, bool) and bool(one == other)
