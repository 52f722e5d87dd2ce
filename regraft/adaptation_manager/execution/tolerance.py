"""Components that fail, or have failed, where an adaptation wants them to do less: that is no reason to undo it."""

from __future__ import annotations

from regraft.adaptation_manager.execution.restoration import values_of
from regraft.adaptation_manager.execution.verify import differences
from regraft.adaptation_manager.steps.actions import PlannedStep, ReachState, StartAgain, StayDown
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.processes import NOT_RUNNING, leave_stopped, start_again
from regraft.bus_schema.messages.protocol.control import ComponentView, ControlCode
from regraft.bus_schema.messages.protocol.host import ProcessState, UpdateSpecs
from regraft.bus_schema.model.lifecycle import DOWNWARD, State, Transition, is_at_most
from regraft.patience import Patience

RETRY_INTERVAL = 0.05
"""Seconds between two looks at a component that may be restarted."""
NOTHING_RUNS = (*NOT_RUNNING, ProcessState.WAITING)
"""States of a process that is started, if at all, as its host's specs state by then."""


async def tolerate_failure(context: ExecutionContext, action: ReachState, failure: ControlFailed) -> None:
    """Accept that a component failed on its way down, once it does no more than was asked of it.

    Raises:
        ControlFailed: ``failure``, if it does not get there, such as one that hangs.
    """
    if failure.code is ControlCode.FENCED:
        raise failure
    await _give_spec(context, action.component)
    if not await _settled(context, action.component, action.state):
        raise failure
    _note(context, action.component, "failed_on_its_way_down", str(failure))


async def has_failed_down(context: ExecutionContext, step: PlannedStep, failure: ControlFailed) -> bool:
    """Return whether a component failed as its activation was undone, and does no more than before: so it is left."""
    do, back = step.do, step.undo
    activated = isinstance(do, ReachState) and do.state is State.ACTIVE
    if failure.code is not ControlCode.FAILED or not activated or not isinstance(back, ReachState):
        return False
    if not await _settled(context, step.component, back.state):
        return False
    context.left_down.add(step.component)
    text = f"{failure}; it is not needed active, and the undo continues"
    code = "failed_in_an_undo"
    context.kit.event("adaptation.failure_tolerated", text, component=step.component, code=code)
    return True


async def stay_down(context: ExecutionContext, action: StayDown) -> None:
    """Leave a component that did not answer down: as its host restarts it, or else without a process.

    One that is to be active is started again instead.

    Raises:
        ControlFailed: its host does not end it.
    """
    name = action.component
    await _give_spec(context, name)
    if not await _settled(context, name, action.state) or not await _is_as_specified(context, name):
        await leave_stopped(context, name, action.host)
        if action.state is State.ACTIVE:
            await start_again(context, StartAgain(name, action.host))
    _note(context, name, "does_not_answer", f"{name} does not answer")


def _note(context: ExecutionContext, name: str, code: str, why: str) -> None:
    context.tolerated.add(name)
    text = f"{why}; it is not needed, and the adaptation continues"
    context.kit.event("adaptation.failure_tolerated", text, component=name, code=code)


async def _give_spec(context: ExecutionContext, name: str) -> None:
    """Have hosts start what is started from now on as it is to be afterwards, or not at all."""
    context.touch(name)
    spec = context.after.components.get(name)
    update = UpdateSpecs(context.revision, removed=(name,)) if spec is None else UpdateSpecs(context.revision, (spec,))
    await context.hosts.give(update)


async def _settled(context: ExecutionContext, name: str, limit: State) -> bool:
    """Return whether a component is at most in a state, or does not run, before the bound."""
    patience = Patience(context.bounds.undo)
    while True:
        await context.refresh()
        process = context.controls.processes.get(name)
        if process is None or process.state in NOTHING_RUNS:
            return True
        try:
            view = await context.controls.read(name).view()
            if is_at_most(view.state, limit) and view.state is not State.FINALIZED:
                return True  # one that is finalized is about to end
            await _lower(context, view, limit)
        except ControlFailed as error:
            if error.code is ControlCode.FENCED:
                raise
        if patience.is_over():
            return False
        await context.pause(RETRY_INTERVAL)


async def _lower(context: ExecutionContext, view: ComponentView, limit: State) -> None:
    """Take a run down that was started as the component was before."""
    if view.state is State.ACTIVE:
        await context.controls.transition(view.component, Transition.DEACTIVATE, context.revision).view()
    elif view.state is State.INACTIVE and limit is DOWNWARD[Transition.CLEANUP]:
        await context.controls.transition(view.component, Transition.CLEANUP, context.revision).view()


async def _is_as_specified(context: ExecutionContext, name: str) -> bool:
    """Return whether a component, if it runs, has the values and connections that it is to have."""
    spec = context.after.components[name]
    if context.controls.living(name) is None:
        return True
    try:
        view = await context.controls.read(name).view()
    except ControlFailed:
        return False
    return not differences(view, values_of(spec, context.after.scopes))
