"""The common part of ``swap`` and ``move``: another run takes a component's place, here or elsewhere.

To swap and to move one component in one adaptation is one hand-over, at the place of the swap. Changes before it
concern the previous class, changes behind it the new one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from regraft.adaptation_manager.steps.actions import EndSuccessor, PlannedStep, Restore, RunSuccessor, TakeOver
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.adaptation import Change, Move, Swap
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State

HANDS_OVER = (State.ACTIVE, State.INACTIVE)


def swap_of(changes: Sequence[Change], component: str) -> int | None:
    """Return the index of the change that swaps a component, None if none does."""
    of_component = (i for i, change in enumerate(changes) if isinstance(change, Swap) and change.component == component)
    return next(of_component, None)


def move_of(changes: Sequence[Change], component: str) -> Move | None:
    """Return the change that moves a component, None if none does."""
    of_component = (change for change in changes if isinstance(change, Move) and change.component == component)
    return next(of_component, None)


def view_of(live: ComponentView, new: ComponentSpec, *, connected: bool = True) -> ComponentView:
    """Return how a component will be once it is as its new spec states."""
    description = new.description
    assert description is not None
    values = {parameter.name: parameter.default for parameter in description.parameters} | new.parameters
    topics = {port.name: new.connections.get(port.name, "") if connected else "" for port in description.ports}
    return replace(live, parameters=values, connections=topics)


def view_of_started(new: ComponentSpec) -> ComponentView:
    """Return how a component will be once it has been started as its spec states."""
    view = ComponentView(new.name, 0, new.state, 0, {}, {})
    return view_of(view, new, connected=new.state is not State.UNCONFIGURED)


def of_state(old: ComponentSpec, new: ComponentSpec, *, with_state: bool) -> str | None:
    """Return why the state cannot be handed over; where there is none, nothing is lost."""
    before, behind = old.description, new.description
    if not with_state or before is None or behind is None or not before.stateful:
        return None
    if before.state_version in behind.restores:
        return None
    takes = ", ".join(map(str, behind.restores))
    goes_on = f"goes on from version {takes}" if behind.restores else "goes on from none"
    return (
        f"the component has a state of version {before.state_version}, and {new.cls} {goes_on}: "
        "with_state: false lets it begin without"
    )


def of_time(draft: Draft, old: ComponentSpec, new: ComponentSpec) -> str | None:
    """Return why one run cannot continue where another stopped, under simulated time; None if it can."""
    before, behind = old.description, new.description
    if not draft.architecture.simulated or before is None or behind is None or before.lockstep == behind.lockstep:
        return None
    lives = "lives in simulated time, and the component by the wall clock"
    if before.lockstep:
        lives = "lives by the wall clock, and the component in simulated time"
    return f"{new.cls} {lives}: remove it, and add another"


@dataclass(frozen=True, slots=True)
class Successor:
    """The succession: the new run, and the one that it replaces; ``live`` is the component's state by then."""

    old: ComponentSpec
    new: ComponentSpec
    live: ComponentView
    with_state: bool


def plan_steps(draft: Draft, succession: Successor, *, start: str, hand_over: str, more: str = "") -> None:
    """Add the two steps: ``start`` the successor next to the component, and ``hand_over``; these are their names."""
    old, new = succession.old, succession.new
    name, incumbent = new.name, draft.started_as.get(new.name) or succession.live.incarnation
    stateful = old.description is not None and old.description.stateful
    beside = PlannedStep(
        name,
        start,
        RunSuccessor(name, new, incumbent, succession.with_state and stateful),
        EndSuccessor(name, new.host, incumbent),
    )
    # A component without connections hands nothing over: it is configured first.
    (draft.preparing if draft.at_first(name) in HANDS_OVER else draft.steps).append(beside)
    without = ", without its state" if stateful and not succession.with_state else ""
    draft.steps.append(
        PlannedStep(
            name,
            f"{hand_over}{without}{more}",
            TakeOver(name, old.host, incumbent, succession.live.state),
            Restore(name, old.host, incumbent, new.host),
        )
    )
