"""After an undo the components that it was about are read back: they must be as they were before."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Sequence

from regraft.adaptation_manager.execution.verify import differences
from regraft.adaptation_manager.steps.actions import PlannedStep, ReachState, StartAgain, TakeOver
from regraft.adaptation_manager.targets.component_client import ControlFailed, NoAnswer
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.processes import leave_stopped, start_again
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.wiring import own_topic
from regraft.patience import Patience

RETRY_INTERVAL = 0.05
"""Seconds between two looks at components that are on their way back."""

Wanted = dict[str, dict[str, object]]
"""By component, and by where it is found: what is to be there again."""


def wanted_again(context: ExecutionContext, undone: Sequence[PlannedStep]) -> Wanted:
    """Return how the components of undone steps are to be again: all their values and connections, and their states.

    A state is given only where a step has changed it: a component may have failed long before.
    """
    found: Wanted = {}
    for step in reversed(undone):
        spec = context.before.components.get(step.component)
        if spec is not None and spec.managed:
            found.setdefault(spec.name, values_of(spec, context.before.scopes)).update(_state(step))
    return found


def values_of(spec: ComponentSpec, scopes: Collection[str]) -> dict[str, object]:
    """Return the values and connections that a component of a system with ``scopes`` should have; without paths."""
    described = spec.description
    if described is None:
        return {}
    values = {p.name: spec.parameters.get(p.name, p.default) for p in described.parameters}
    paths = {p.name for p in described.parameters if p.names_files or _is_absolute(values[p.name])}
    found: dict[str, object] = {f"parameters.{name}": values[name] for name in values.keys() - paths}
    return found | {
        f"connect.{p.name}": spec.connections.get(p.name, own_topic(spec, p, scopes)) for p in described.ports
    }


def _is_absolute(value: object) -> bool:
    """Return whether a value is a path that another host may have put into a folder of its own."""
    return isinstance(value, str) and value.startswith("/")


def _state(step: PlannedStep) -> dict[str, object]:
    """Return the state that undoing a step leads back to, if it is about one."""
    state: State | None = None
    if isinstance(step.undo, ReachState):
        state = step.undo.state
    elif isinstance(step.do, TakeOver):
        state = step.do.state
    return {} if state is None else {"state": state.value}


async def begin_again(context: ExecutionContext, names: Collection[str]) -> list[str]:
    """Have components that no step brings back begin again, if they are back by the later spec; returns why not.

    They did not answer in the check: a run that does not answer now has come since. One whose host is not there is
    noted as out of reach: it begins again as that joins.
    """
    problems = []
    living = sorted(name for name in names if context.controls.living(name) is not None)
    for name in living:
        spec = context.before.components[name]
        if not await _may_be_later(context, spec):
            continue
        try:
            await leave_stopped(context, name, spec.host)
            await start_again(context, StartAgain(name, spec.host))
        except ControlFailed as error:
            with contextlib.suppress(ControlFailed):  # else the last report of the hosts holds
                await context.refresh()
            context.note_reach(name)
            if name not in context.out_of_reach:
                problems.append(f"{name}: could not begin again: {error}")
    return problems


async def _may_be_later(context: ExecutionContext, spec: ComponentSpec) -> bool:
    """Return whether a component's run may have begun by its spec after the adaptation."""
    if not spec.managed:
        return True
    try:
        view = await context.controls.read(spec.name).view()
    except ControlFailed:
        return True
    former = _standing(spec, context.before.scopes)
    later = _standing(context.after.components[spec.name], context.after.scopes)
    changed = {where: value for where, value in former.items() if later.get(where) != value}
    return not changed or bool(differences(view, changed))


def _standing(spec: ComponentSpec, scopes: Collection[str]) -> dict[str, object]:
    return values_of(spec, scopes) | {"state": spec.state.value}


async def not_restored(context: ExecutionContext, wanted: Wanted) -> dict[str, str]:
    """Return what is not as it is ``wanted``, in words by component; looks again while that may still come.

    A component that does not run, or does not answer, is left out: its host starts it as it was before.
    """
    patience = Patience(context.bounds.undo)
    while True:
        try:
            await context.refresh()
        except ControlFailed:
            return {}  # the current run is unknown: its host gets the former specs when it answers
        found = await _compared(context, wanted)
        if not found or patience.is_over():
            return found
        wanted = {name: wanted[name] for name in found}
        await context.pause(RETRY_INTERVAL)


def _still_wanted(wanted: dict[str, object], view: ComponentView, before: ComponentSpec) -> dict[str, object]:
    """Return what is still to be there again: a component that had failed may also be in the state of its spec.

    A run that its host has started meanwhile is in that state.
    """
    if view.state is not before.state:
        return wanted
    return {place: value for place, value in wanted.items() if place != "state"}


async def _compared(context: ExecutionContext, wanted: Wanted) -> dict[str, str]:
    found = {}
    asked = {name: context.controls.read(name) for name in sorted(wanted) if context.controls.living(name)}
    for name, reading in asked.items():
        try:
            view = await reading.view()
            wrong = differences(view, _still_wanted(wanted[name], view, context.before.components[name]))
        except NoAnswer:
            continue
        except ControlFailed as error:
            wrong = [str(error)]
        if wrong:
            found[name] = "; ".join(wrong)
    return found
