"""Entering a mode: its transitions say which state is to be reached, from whichever there is."""

from __future__ import annotations

from collections.abc import Iterable

from regraft.bus_schema.model.adaptation import Change, ChangeState, Connect, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State, Transition, after, route
from regraft.bus_schema.model.parameter_values import effective_parameter

GOALS = {
    Transition.CONFIGURE: (State.INACTIVE, State.ACTIVE),
    Transition.ACTIVATE: (State.ACTIVE,),
    Transition.DEACTIVATE: (State.INACTIVE, State.UNCONFIGURED),
    Transition.CLEANUP: (State.UNCONFIGURED,),
}
"""The state that a transition of a mode is to lead to, and others that will do."""


def as_needed(
    changes: Iterable[Change], architecture: Architecture, earlier: Iterable[Change] = ()
) -> tuple[Change, ...]:
    """Return the changes of a mode with the transitions that lead from how things are, after ``earlier`` changes."""
    states = {name: spec.state for name, spec in architecture.components.items()}
    for change in earlier:
        if isinstance(change, ChangeState) and change.component in states:
            states[change.component] = after(states[change.component], change.transition) or states[change.component]
    needed: list[Change] = []
    for change in changes:
        goals = GOALS.get(change.transition) if isinstance(change, ChangeState) else None
        start = states.get(change.component)
        if not isinstance(change, ChangeState) or goals is None or start is None:
            needed.append(change)
        elif start not in goals:
            way = route(start, goals[0])
            needed += [ChangeState(change.component, step) for step in way] if way else [change]
            states[change.component] = goals[0]
    return tuple(needed)


def is_in_force(changes: Iterable[Change], architecture: Architecture) -> bool:
    """Tell whether all is as a mode wants it: the inference of modes (exactly equal, no ranges)."""
    return all(_is_so(change, architecture) for change in changes)


def _is_so(change: Change, architecture: Architecture) -> bool:
    spec = architecture.components.get(change.component)
    if change.change in ("add", "remove"):
        return (spec is not None) == (change.change == "add")
    if spec is None:
        return False
    if isinstance(change, SetParameters):
        if spec.description is None:
            return all(spec.parameters.get(name) == value for name, value in change.parameters.items())
        now = {name: effective_parameter(spec.description, spec.parameters, name) for name in change.parameters}
        return now == change.parameters
    if isinstance(change, Connect):
        return spec.connections.get(change.port) == change.topic
    return isinstance(change, ChangeState) and spec.state in GOALS.get(change.transition, ())
