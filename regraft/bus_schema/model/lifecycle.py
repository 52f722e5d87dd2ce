"""The lifecycle of a component: ROS 2's states and transitions (design article "Managed nodes")."""

from __future__ import annotations

from enum import Enum


class State(Enum):
    """A primary state, or the transition state between two."""

    UNCONFIGURED = "unconfigured"
    INACTIVE = "inactive"
    ACTIVE = "active"
    FINALIZED = "finalized"
    CONFIGURING = "configuring"
    CLEANING_UP = "cleaningup"
    ACTIVATING = "activating"
    DEACTIVATING = "deactivating"
    SHUTTING_DOWN = "shuttingdown"
    ERROR_PROCESSING = "errorprocessing"


class Transition(Enum):
    """The lifecycle transitions that a component can be asked for."""

    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    CLEANUP = "cleanup"
    SHUTDOWN = "shutdown"


PRIMARY = (State.UNCONFIGURED, State.INACTIVE, State.ACTIVE, State.FINALIZED)

LASTING = (State.UNCONFIGURED, State.INACTIVE, State.ACTIVE)
"""The states in which a component stays: a finalized one only ends."""

TRANSITIONS: dict[tuple[State, Transition], tuple[State, State]] = {
    (State.UNCONFIGURED, Transition.CONFIGURE): (State.CONFIGURING, State.INACTIVE),
    (State.INACTIVE, Transition.ACTIVATE): (State.ACTIVATING, State.ACTIVE),
    (State.ACTIVE, Transition.DEACTIVATE): (State.DEACTIVATING, State.INACTIVE),
    (State.INACTIVE, Transition.CLEANUP): (State.CLEANING_UP, State.UNCONFIGURED),
    (State.UNCONFIGURED, Transition.SHUTDOWN): (State.SHUTTING_DOWN, State.FINALIZED),
    (State.INACTIVE, Transition.SHUTDOWN): (State.SHUTTING_DOWN, State.FINALIZED),
    (State.ACTIVE, Transition.SHUTDOWN): (State.SHUTTING_DOWN, State.FINALIZED),
}
"""From a primary state by a transition: the state on the way, and the state at its end."""


_HEIGHTS = {State.ERROR_PROCESSING: 0, State.FINALIZED: 0, State.UNCONFIGURED: 1, State.INACTIVE: 2}

DOWNWARD = {Transition.DEACTIVATE: State.INACTIVE, Transition.CLEANUP: State.UNCONFIGURED}
"""The transitions after which a component does less, and the state that each leads to."""


def is_at_most(state: State, limit: State) -> bool:
    """Return whether a component in ``state`` does no more than one in the primary state ``limit``.

    Failed components do least of all. A component on its way between two states may still act.
    """
    return _HEIGHTS.get(state, 3) <= _HEIGHTS.get(limit, 3)


def is_lower(state: State, wanted: State) -> bool:
    """Return whether a component in ``state`` does less than one in the primary state ``wanted``."""
    return state is not wanted and is_at_most(state, wanted)


def after(state: State, transition: Transition) -> State | None:
    """Return the state that ``transition`` leads to from ``state``, None where it is not legal."""
    way = TRANSITIONS.get((state, transition))
    return way[1] if way else None


def legal(state: State) -> tuple[Transition, ...]:
    """Return the transitions that ``state`` allows."""
    return tuple(transition for start, transition in TRANSITIONS if start is state)


def route(start: State, goal: State) -> tuple[Transition, ...] | None:
    """Return the shortest way of transitions from one primary state to another, None if there is none."""
    frontier: list[tuple[State, tuple[Transition, ...]]] = [(start, ())]
    seen = {start}
    for state, way in frontier:
        if state is goal:
            return way
        for transition in legal(state):
            following = TRANSITIONS[state, transition][1]
            if following not in seen:
                seen.add(following)
                frontier.append((following, (*way, transition)))
    return None
