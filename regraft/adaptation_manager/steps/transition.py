"""``transition``: the spec's state and the running component's go through one lifecycle transition."""

from __future__ import annotations

from dataclasses import replace

from regraft.adaptation_manager.steps.actions import PlannedStep, ReachState
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.annotations import Connections
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.adaptation import ChangeState
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import DOWNWARD, State, Transition, after, is_at_most, legal
from regraft.bus_schema.model.modes.modes import GOALS


def plan(draft: Draft, change: ChangeState) -> None:
    """Add the change to the draft; it must be legal from the state that the component is in by then."""
    name, transition = change.component, change.transition
    if name == draft.manager:
        draft.refuse(name, "transition", "the adaptation manager cannot change its own state")
        return
    if transition is Transition.SHUTDOWN:
        draft.refuse(
            name,
            "transition",
            "shutdown ends the process and cannot be undone, so it is not supported yet by this version; "
            "deactivate and cleanup leave the component unconfigured, remove ends it",
        )
        return
    live = draft.live.get(name)
    spec = draft.spec(name)
    lower = DOWNWARD.get(transition)
    if lower is not None and _is_down_already(live, spec, lower):
        draft.update(replace(spec, state=lower))
        return
    if lower is None and live is not None and _is_up_already(live, spec, transition):
        draft.update(replace(spec, state=live.state))
        return
    state = live.state if live else spec.state
    by: Transition | None = transition
    following = after(state, transition)
    if (state, spec.state, transition) == (State.UNCONFIGURED, State.INACTIVE, Transition.ACTIVATE):
        following, by = State.ACTIVE, None  # it failed while it was inactive, and is configured again on the way
    if following is None:
        possible = ", ".join(t.value for t in legal(state)) or "none"
        draft.refuse(
            name,
            "transition",
            f"{transition.value} is not possible while {state.value}; possible: {possible}",
        )
        return
    draft.update(replace(spec, state=following))
    if live is None:
        return
    draft.steps.append(
        PlannedStep(
            name,
            f"{transition.value} (from {state.value})",
            ReachState(name, following, dict(spec.connections), by),
            ReachState(name, state, dict(live.connections if live.connections else spec.connections)),
        )
    )
    draft.live[name] = replace(live, state=following, connections=_connections(draft, name, following))


def _is_down_already(live: ComponentView | None, spec: ComponentSpec, lower: State) -> bool:
    """Return whether a component is where a transition leads by itself: it has failed, and the spec has to follow."""
    return not is_at_most(spec.state, lower) and (live is None or is_at_most(live.state, lower))


def _is_up_already(live: ComponentView, spec: ComponentSpec, transition: Transition) -> bool:
    """Return whether a component is where a transition leads already, as a run that began by an earlier spec is."""
    return live.state in GOALS[transition] and spec.state not in GOALS[transition]


def _connections(draft: Draft, name: str, state: State) -> Connections:
    live = draft.live[name].connections
    unconnected: Connections = dict.fromkeys(live, "")
    return unconnected if state is State.UNCONFIGURED else {**live, **draft.spec(name).connections}
