"""The lifecycle is ROS 2's (design article "Managed nodes")."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.model.lifecycle import PRIMARY, TRANSITIONS, State, Transition, after, legal, route

ROS_2 = {
    ("unconfigured", "configure"): ("configuring", "inactive"),
    ("inactive", "cleanup"): ("cleaningup", "unconfigured"),
    ("inactive", "activate"): ("activating", "active"),
    ("active", "deactivate"): ("deactivating", "inactive"),
    ("unconfigured", "shutdown"): ("shuttingdown", "finalized"),
    ("inactive", "shutdown"): ("shuttingdown", "finalized"),
    ("active", "shutdown"): ("shuttingdown", "finalized"),
}


def test_the_transitions_are_those_of_ros_2() -> None:
    ours = {
        (start.value, asked.value): (on_the_way.value, end.value)
        for (start, asked), (on_the_way, end) in TRANSITIONS.items()
    }
    assert ours == ROS_2


def test_every_transition_leads_where_ros_2_says_or_nowhere() -> None:
    for state, transition in product(State, Transition):
        end = ROS_2.get((state.value, transition.value))
        assert after(state, transition) == (State(end[1]) if end else None), (state, transition)
        assert (transition in legal(state)) == (end is not None), (state, transition)


def test_nothing_leaves_finalized_or_a_transition_state() -> None:
    for state in set(State) - {State.UNCONFIGURED, State.INACTIVE, State.ACTIVE}:
        assert legal(state) == ()


@pytest.mark.parametrize(
    ("start", "goal", "way"),
    [
        (State.UNCONFIGURED, State.ACTIVE, ("configure", "activate")),
        (State.ACTIVE, State.UNCONFIGURED, ("deactivate", "cleanup")),
        (State.ACTIVE, State.INACTIVE, ("deactivate",)),
        (State.ACTIVE, State.FINALIZED, ("shutdown",)),
        (State.UNCONFIGURED, State.FINALIZED, ("shutdown",)),
        (State.INACTIVE, State.INACTIVE, ()),
        (State.FINALIZED, State.ACTIVE, None),
        (State.ACTIVE, State.CONFIGURING, None),
    ],
)
def test_a_route_is_the_shortest_way(start: State, goal: State, way: tuple[str, ...] | None) -> None:
    found = route(start, goal)
    assert (None if found is None else tuple(step.value for step in found)) == way


@given(st.sampled_from(PRIMARY), st.sampled_from(PRIMARY))
def test_following_a_route_ends_at_its_goal(start: State, goal: State) -> None:
    way = route(start, goal)
    if way is None:
        assert start is State.FINALIZED
        return
    state: State | None = start
    for transition in way:
        assert state is not None
        state = after(state, transition)
    assert state is goal
