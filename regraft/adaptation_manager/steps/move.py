"""``move``: a component continues at another host; or is started there, if what ran it is lost.

A component that is swapped in the same adaptation is handed over by its swap, to the other host.
"""

from __future__ import annotations

from dataclasses import fields, replace

from regraft.adaptation_manager.steps import start_elsewhere
from regraft.adaptation_manager.steps.draft import Draft
from regraft.adaptation_manager.steps.succession import HANDS_OVER, Successor, of_state, plan_steps, swap_of
from regraft.bus_schema.model.adaptation import Move
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.description import Description


def plan(draft: Draft, change: Move) -> None:
    """Add the change to the draft, with the class as the other host describes it; where it is already, it stays."""
    if swap_of(draft.changes, change.component) is not None:
        _plan_with_swap(draft, change)
    elif start_elsewhere.is_wanted(draft, change):
        start_elsewhere.plan(draft, change)
    else:
        _plan(draft, change)


def _plan_with_swap(draft: Draft, change: Move) -> None:
    """Judge where the component goes; the swap is what goes there."""
    name = change.component
    spec = draft.before.get(name) or draft.spec(name)
    problems = _of_component(draft, spec) or _of_place(draft, change)
    for where, problem in problems:
        draft.refuse(name, where, problem)
    draft.moved.add(name)


def _plan(draft: Draft, change: Move) -> None:
    name = change.component
    spec = draft.spec(name)
    live = draft.live.get(name)
    problems = _of_component(draft, spec)
    if live is not None and live.state not in HANDS_OVER and not problems:
        problem = f"is {live.state.value} by then: only an active or inactive component hands over"
        problems.append(("component", problem))
    problems += _of_place(draft, change)
    described = draft.described.get(-1 if draft.index is None else draft.index)
    if described is not None and described.spec.description is not None:
        problems += _of_class(change, spec, described.spec)
    for where, problem in problems:
        draft.refuse(name, where, problem)
    draft.moved.add(name)
    if spec.host == change.host or change.host not in draft.architecture.hosts:
        return
    new = replace(spec, host=change.host)
    draft.update(new)
    if live is not None and not problems:
        plan_steps(
            draft,
            Successor(spec, new, live, with_state=change.with_state),
            start=f"start it on {new.host} beside that on {spec.host}",
            hand_over=f"hand over to {new.host}",
        )


def _of_component(draft: Draft, spec: ComponentSpec) -> list[tuple[str, str]]:
    """Return why a component cannot be moved at all, wherever to."""
    name = spec.name
    refused = ""
    if name == draft.manager:
        refused = "cannot be moved: it carries out the move; it is placed by the stack"
    elif spec.description is not None and spec.description.is_time_source:
        refused = "cannot be moved: it is the source of simulated time, at the first host"
    elif not spec.managed:
        refused = "is unmanaged: it does not speak the lifecycle"
    elif not spec.cls:
        refused = "runs a program, which hands nothing over: remove it, and add it on the other host"
    elif name in draft.added:
        refused = "is added in the same request: add it where it is to be"
    elif name in draft.moved:
        refused = "is moved twice in the same request: leave one out"
    return [("component", refused)] if refused else []


def _of_place(draft: Draft, change: Move) -> list[tuple[str, str]]:
    """Return why nothing can be started at the other host; whether it has room shows in the result."""
    return [("host", draft.absent[change.host])] if change.host in draft.absent else []


def _of_class(change: Move, spec: ComponentSpec, there: ComponentSpec) -> list[tuple[str, str]]:
    """Return what is wrong with the class on the other host: it must be the same, and take the state."""
    here, other = spec.description, there.description
    assert other is not None
    differences = _differences(here, other)
    if differences:
        needed = f"host {change.host!r} has another {spec.cls}: its {differences} differ; both need the same version"
        return [("class", needed)]
    problem = of_state(spec, there, with_state=change.with_state)
    return [("with_state", problem)] if problem is not None else []


def _differences(here: Description | None, other: Description) -> str:
    if here is None:
        return ""
    names = [field.name for field in fields(Description)]
    return ", ".join(name for name in names if getattr(here, name) != getattr(other, name))
