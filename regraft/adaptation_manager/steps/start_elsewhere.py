"""``move`` of what was on a host that is lost: it is started elsewhere, from its last checkpoint if it has one."""

from __future__ import annotations

from dataclasses import replace

from regraft.adaptation_manager.steps.actions import Activate, EndProcess, PlannedStep, RunProcess
from regraft.adaptation_manager.steps.draft import Draft
from regraft.adaptation_manager.steps.succession import view_of_started
from regraft.bus_schema.messages.protocol.host import LEAVE_OUT
from regraft.bus_schema.model.adaptation import Move
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.suggestions import instead_of


def is_wanted(draft: Draft, change: Move) -> bool:
    """Return whether there is nobody to move any more: the component's host is lost."""
    return draft.spec(change.component).host in draft.lost


def plan(draft: Draft, change: Move) -> None:
    """Add the change to the draft."""
    spec = draft.spec(change.component)
    if change.host not in draft.architecture.hosts:
        there_are = instead_of(change.host, draft.architecture.hosts)
        draft.refuse(spec.name, "host", f"there is no host {change.host!r}; {there_are}")
    elif change.host in draft.absent:
        draft.refuse(spec.name, "host", draft.absent[change.host])
    else:
        plan_start(draft, replace(spec, host=change.host))


def plan_start(draft: Draft, spec: ComponentSpec, *, with_state: bool = True) -> None:
    """Add the steps that start a component as ``spec`` states, at another host than that which is lost."""
    back = EndProcess(spec.name, spec.host)
    inactive = spec.managed and spec.state is not State.UNCONFIGURED
    state = State.INACTIVE if inactive else State.UNCONFIGURED
    run = RunProcess(spec.name, spec, state, resume=with_state, leave_out=LEAVE_OUT, afresh=not with_state)
    which = "it" if spec.cls == draft.before[spec.name].cls else spec.cls
    since = "from its last checkpoint" if with_state else "without its state"
    started = PlannedStep(spec.name, f"start {which} on {spec.host}, {since}", run, back)
    (draft.preparing if spec.managed else draft.steps).append(started)
    if spec.managed and spec.state is State.ACTIVE:
        draft.steps.append(PlannedStep(spec.name, "connect and activate", Activate(spec.name), back))
    draft.update(spec)
    if spec.managed:
        draft.live[spec.name] = view_of_started(spec)
