"""What ``swap`` and ``move`` have in common: another run goes on in the place of a component's, here or elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

from adaptation_manager.steps.actions import EndSuccessor, GiveBack, PlannedStep, RunSuccessor, TakeOver
from adaptation_manager.steps.draft import Draft
from bus_schema.adaptation import Move, Swap
from bus_schema.architecture import ComponentSpec
from bus_schema.lifecycle import State
from bus_schema.messages.control import ComponentView

HANDS_OVER = (State.ACTIVE, State.INACTIVE)


def of_state(change: Swap | Move, old: ComponentSpec, new: ComponentSpec) -> str | None:
    """Return why the state cannot be handed over; where there is none, nothing is lost."""
    before, behind = old.description, new.description
    if not change.with_state or before is None or behind is None or not before.stateful:
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
    """Return why one run cannot go on where another stopped, under simulated time; None if it can."""
    before, behind = old.description, new.description
    if not draft.architecture.simulated or before is None or behind is None or before.in_step == behind.in_step:
        return None
    lives = "lives in simulated time, and the component by the wall clock"
    if before.in_step:
        lives = "lives by the wall clock, and the component in simulated time"
    return f"{new.cls} {lives}: remove it, and add another"


@dataclass(frozen=True, slots=True)
class Successor:
    """What takes over, and from whom; ``live`` is how the component is by then."""

    old: ComponentSpec
    new: ComponentSpec
    live: ComponentView
    with_state: bool


def plan_steps(draft: Draft, succession: Successor, *, start: str, hand_over: str, more: str = "") -> None:
    """Add the two steps: ``start`` the successor beside the component, and ``hand_over``; these are their names."""
    old, new = succession.old, succession.new
    name, incumbent = new.name, draft.begun.get(new.name) or succession.live.incarnation
    stateful = old.description is not None and old.description.stateful
    beside = PlannedStep(
        name,
        start,
        RunSuccessor(name, new, incumbent, succession.with_state and stateful),
        EndSuccessor(name, new.host, incumbent),
    )
    # What has no connections yet hands nothing over: it is configured first.
    (draft.preparing if draft.at_first(name) in HANDS_OVER else draft.steps).append(beside)
    without = ", without its state" if stateful and not succession.with_state else ""
    draft.steps.append(
        PlannedStep(
            name,
            f"{hand_over}{without}{more}",
            TakeOver(name, old.host, incumbent, succession.live.state),
            GiveBack(name, old.host, incumbent, new.host),
        )
    )
