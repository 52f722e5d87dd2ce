"""``move``: a component goes on at another host; or is started there, if what ran it is lost."""

from __future__ import annotations

from dataclasses import fields, replace

from adaptation_manager.steps import rescue
from adaptation_manager.steps.draft import Draft
from adaptation_manager.steps.succeeding import HANDS_OVER, Successor, of_state, of_time, plan_steps
from bus_schema.adaptation import Move
from bus_schema.architecture import ComponentSpec
from bus_schema.description import Description


def plan(draft: Draft, change: Move) -> None:
    """Add the change to the draft, with the class as the other host describes it; where it is already, it stays."""
    if rescue.is_rescue(draft, change):
        rescue.plan(draft, change)
        return
    name = change.component
    spec = draft.spec(name)
    problems = _refusals(draft, change, spec)
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
    live = draft.live.get(name)
    if live is not None and not problems:
        plan_steps(
            draft,
            Successor(spec, new, live, with_state=change.with_state),
            start=f"start it on {new.host} beside that on {spec.host}",
            hand_over=f"hand over to {new.host}",
        )


def _refusals(draft: Draft, change: Move, spec: ComponentSpec) -> list[tuple[str, str]]:
    """Return the fields and reasons why there can be no move, whatever the other host says."""
    found = []
    refused = _of_component(draft, spec)
    if refused:
        found.append(("component", refused))
    if change.host in draft.absent:
        found.append(("host", draft.absent[change.host]))
    if change.host == spec.host or change.host not in draft.architecture.hosts:
        return found
    problem = of_time(draft, spec, spec)
    if problem is not None:
        found.append(("component", problem))
    needed = spec.description.resources.devices if spec.description else ()
    for device in sorted(set(needed) - set(draft.architecture.rules(change.host).devices)):
        there = f"host {change.host!r} has none that the stack names under hosts.{change.host}.devices"
        found.append(("resources.devices", f"needs {device} for itself, which stays on {spec.host!r}: {there}"))
    return found


def _of_component(draft: Draft, spec: ComponentSpec) -> str:
    """Return why a component cannot be moved, empty if it can."""
    name = spec.name
    live = draft.live.get(name)
    if name == draft.manager:
        return "cannot be moved: it carries out the move; it is placed by the stack"
    if spec.description is not None and spec.description.makes_time:
        return "cannot be moved: simulated time goes on with it, at the first host"
    if not spec.managed:
        return "is unmanaged: it does not speak the lifecycle"
    if not spec.cls:
        return "runs a program, which hands nothing over: remove it, and add it on the other host"
    if name in draft.added:
        return "is added in the same request: add it where it is to be"
    if name in draft.swapped:
        return "is swapped in the same request: move it in another, before or after that"
    if name in draft.moved:
        return "is moved twice in the same request: leave one out"
    if live is not None and live.state not in HANDS_OVER:
        return f"is {live.state.value} by then: only an active or inactive component hands over"
    return ""


def _of_class(change: Move, spec: ComponentSpec, there: ComponentSpec) -> list[tuple[str, str]]:
    """Return what is wrong with the class on the other host: it must be the same, and take the state."""
    here, other = spec.description, there.description
    assert other is not None
    differences = _differences(here, other)
    if differences:
        needed = f"host {change.host!r} has another {spec.cls}: its {differences} differ; both need the same version"
        return [("cls", needed)]
    problem = of_state(change, spec, there)
    return [("with_state", problem)] if problem is not None else []


def _differences(here: Description | None, other: Description) -> str:
    if here is None:
        return ""
    names = [field.name for field in fields(Description)]
    return ", ".join(name for name in names if getattr(here, name) != getattr(other, name))
