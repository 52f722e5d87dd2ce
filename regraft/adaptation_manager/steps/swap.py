"""``swap``: a successor is started next to the component, and takes over from it when it is its turn.

If the component is moved in the same adaptation, it is started on the other host.
"""

from __future__ import annotations

from dataclasses import replace

from regraft.adaptation_manager.steps import start_elsewhere
from regraft.adaptation_manager.steps.actions import Activate, LeaveStopped, PlannedStep, RunProcess, StartAgain
from regraft.adaptation_manager.steps.draft import Draft
from regraft.adaptation_manager.steps.succession import (
    HANDS_OVER,
    Successor,
    move_of,
    of_state,
    of_time,
    plan_steps,
    view_of,
    view_of_started,
)
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.adaptation import Connect, SetParameters, Swap
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.lifecycle import State
from regraft.stack.successor import successor


def plan(draft: Draft, change: Swap) -> None:
    """Add the change to the draft, with the spec as the component's host describes it."""
    name = change.component
    spec = draft.spec(name)
    described = draft.described.get(-1 if draft.index is None else draft.index)
    refused = _refusal(draft, change, spec)
    if refused is not None:
        draft.refuse(name, *refused)
        return
    draft.swapped.add(name)
    _judge_earlier_changes(draft, spec)
    if described is None or described.violations or described.spec.description is None:
        return
    new = successor(change, spec, described.spec, draft.architecture)
    moved = move_of(draft.changes, name)
    with_state = change.with_state and (moved is None or moved.with_state)
    problem = of_state(spec, new, with_state=with_state)
    if problem is not None:
        draft.refuse(name, "with_state", problem)
    problem = of_time(draft, spec, new)
    if problem is not None:
        draft.refuse(name, "class", problem)
    draft.update(new)
    live = draft.live.get(name)
    if live is not None and live.state in HANDS_OVER:
        _plan_steps(draft, new, live, with_state=with_state)
    elif new.host == spec.host:
        _plan_replacement(draft, new, with_state=with_state)
    elif spec.host in draft.lost:
        start_elsewhere.plan_start(draft, new, with_state=with_state)


def _refusal(draft: Draft, change: Swap, spec: ComponentSpec) -> tuple[str, str] | None:
    """Return the field and the reason why there can be no swap at all."""
    name = change.component
    live = draft.live.get(name)
    if spec.description is not None and spec.description.is_time_source:
        return "component", "cannot be swapped: it is the source of simulated time; change it in the stack"
    if name == draft.manager:
        return "component", "cannot be swapped: it carries out the swap; it is exchanged with the stack"
    if not spec.cls:
        return "component", "runs a program, which hands nothing over: remove it, and add another"
    if name in draft.added:
        return "component", "is added in the same request: add it as it is to be"
    if name in draft.swapped:
        return "component", "is swapped twice in the same request: leave one out"
    if live is not None and live.state not in (*HANDS_OVER, State.UNCONFIGURED):
        return "component", f"is {live.state.value} by then: only an active or inactive component hands over"
    if live is not None and live.state is State.UNCONFIGURED and move_of(draft.changes, name) is not None:
        return "component", "is unconfigured by then: it is swapped where it is, or removed and added elsewhere"
    return None


def _judge_earlier_changes(draft: Draft, spec: ComponentSpec) -> None:
    """Refuse what the previous class cannot be given: it is gone from the architecture that results."""
    decided: dict[str, int] = {}
    for index, change in enumerate(draft.changes[: draft.index]):
        if change.component == spec.name and isinstance(change, SetParameters):
            decided |= {f"parameters.{name}": index for name in change.parameters}
        elif change.component == spec.name and isinstance(change, Connect):
            decided[f"connect.{change.port}"] = index
    if decided:
        # As of an inactive component: who feeds it is judged in the end.
        found = violations(draft.architecture.with_component(replace(spec, state=State.INACTIVE)))
        ours = (one for one in found if one.component == spec.name and one.field in decided)
        draft.violations += [replace(one, change=decided[one.field]) for one in ours]


def _plan_replacement(draft: Draft, new: ComponentSpec, *, with_state: bool) -> None:
    """Start a component that does not run, or is not configured, as the other that it is to be.

    There is nobody to take over from. One that is configured still goes down first, as its earlier changes state.
    """
    name, stopped = new.name, LeaveStopped(new.name, new.host)
    steps = draft.steps if draft.at_first(name) in HANDS_OVER else draft.preparing
    unconfigured = name in draft.live
    if unconfigured or name in draft.restarting:
        again = StartAgain(name, new.host, unconfigured)
        why = "is unconfigured" if unconfigured else "keeps ending"
        steps.append(PlannedStep(name, f"stop {draft.before[name].cls}, which {why}", stopped, again))
    prepared = State.UNCONFIGURED if new.state is State.UNCONFIGURED else State.INACTIVE
    start = RunProcess(name, new, prepared, afresh=not with_state)
    steps.append(PlannedStep(name, f"start {new.cls} in its place, {prepared.value}", start, stopped))
    if new.state is State.ACTIVE:
        draft.steps.append(PlannedStep(name, "connect and activate", Activate(name), stopped))
    draft.live[name] = view_of_started(new)


def _plan_steps(draft: Draft, new: ComponentSpec, live: ComponentView, *, with_state: bool) -> None:
    old = draft.before[new.name]
    lets_go = old.description is not None and old.description.exclusive
    at = f" on {new.host}" if new.host != old.host else ""
    plan_steps(
        draft,
        Successor(old, new, live, with_state),
        start=f"start {new.cls}{at} beside {f'that on {old.host}' if at else 'it'}",
        hand_over=f"hand over to {new.cls}{at}",
        more=", with a gap: it lets go first" if lets_go else "",
    )
    draft.live[new.name] = view_of(live, new)
