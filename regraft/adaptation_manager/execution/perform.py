"""Performs actions on running components."""

from __future__ import annotations

from collections.abc import Callable

from regraft.adaptation_manager.execution.tolerance import RETRY_INTERVAL, stay_down, tolerate_failure
from regraft.adaptation_manager.steps.actions import (
    Action,
    Activate,
    ApplyParameters,
    ConnectAgain,
    ConnectPort,
    EndSuccessor,
    LeaveStopped,
    ReachState,
    Restore,
    RunProcess,
    RunSuccessor,
    StartAgain,
    StayDown,
    TakeOver,
)
from regraft.adaptation_manager.targets.component_client import ControlFailed, NoAnswer
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.handover import end_successor, give_back, run_successor, take_over
from regraft.adaptation_manager.targets.processes import end_process, leave_stopped, run_process, start_again, take_part
from regraft.adaptation_manager.targets.rewiring import abandon, move_port
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.lifecycle import Transition, after, is_at_most, route
from regraft.patience import Patience


async def perform(context: ExecutionContext, action: Action, meanwhile: Callable[[], object] | None = None) -> None:
    """Reach the end that ``action`` names; raises ControlFailed where it cannot be reached.

    ``meanwhile`` is called while a component is setting its values.
    """
    if isinstance(action, ApplyParameters):
        await _give_values(context, action, meanwhile)
    elif isinstance(action, ConnectPort):
        await _connect_port(context, action)
    elif isinstance(action, ReachState):
        await _reach_state(context, action)
    elif isinstance(action, StayDown):
        await stay_down(context, action)
    elif isinstance(action, ConnectAgain):
        await _connect_again(context, action)
    elif isinstance(action, RunProcess):
        await run_process(context, action)
    elif isinstance(action, Activate):
        await take_part(context, action)
    elif isinstance(action, RunSuccessor):
        await run_successor(context, action)
    elif isinstance(action, TakeOver):
        await take_over(context, action)
    elif isinstance(action, Restore):
        await give_back(context, action)
    elif isinstance(action, LeaveStopped):
        await leave_stopped(context, action.component, action.host)
    elif isinstance(action, StartAgain):
        await start_again(context, action)
    elif isinstance(action, EndSuccessor):
        await end_successor(context, action)
    else:
        await end_process(context, action.component, action.host)


async def _give_values(
    context: ExecutionContext, action: ApplyParameters, meanwhile: Callable[[], object] | None
) -> None:
    if action.values:
        context.touch(action.component)
        asked = context.controls.set_parameters(action.component, action.values, context.revision)
        if meanwhile is not None:
            meanwhile()
        await asked.view()


async def _connect_port(context: ExecutionContext, action: ConnectPort) -> None:
    view = await context.controls.read(action.component).view()
    await _connect(context, view, action.port, action.topic)


async def _connect(context: ExecutionContext, view: ComponentView, port: str, topic: str | None) -> None:
    now = view.connections.get(port, "")
    if now == topic:
        await abandon(context, view.component, port)
    elif now != "":
        await move_port(context, view.component, port, topic)


async def _connect_again(context: ExecutionContext, action: ConnectAgain) -> None:
    """Wait for a component that may have been started with other connections; one that stays silent is left alone."""
    wanted = context.before.components[action.component].state
    patience = Patience(context.bounds.undo)
    while not patience.is_over():
        await context.refresh()
        try:
            view = await context.controls.read(action.component).view()
        except NoAnswer:
            view = None
        if view is not None and view.state is wanted:
            for port, topic in sorted(action.connections.items()):
                await _connect(context, view, port, topic)
            return
        await context.pause(RETRY_INTERVAL)


async def _reach_state(context: ExecutionContext, action: ReachState) -> None:
    try:
        await _walk(context, action)
    except ControlFailed as failure:
        if not action.leads_down:
            raise
        await tolerate_failure(context, action, failure)


async def _walk(context: ExecutionContext, action: ReachState) -> None:
    view = await context.controls.read(action.component).view()
    if view.state is action.state or (action.leads_down and is_at_most(view.state, action.state)):
        return
    context.touch(action.component)
    for transition in _way(view, action):
        view = await context.controls.transition(
            action.component, transition, context.revision, hold=action.hold
        ).view()
        # A process is configured with the connections that it was started with; they may have changed since.
        if transition is Transition.CONFIGURE:
            for port, topic in sorted(action.connections.items()):
                if view.connections.get(port, topic) != topic:
                    await _connect(context, view, port, topic)


def _way(view: ComponentView, action: ReachState) -> tuple[Transition, ...]:
    if action.by is not None:
        if after(view.state, action.by) is not action.state:
            raise ControlFailed(f"{view.component}: {action.by.value} is not possible: it is {view.state.value} by now")
        return (action.by,)
    way = route(view.state, action.state)
    if way is None:
        raise ControlFailed(f"{view.component}: {action.state.value} cannot be reached from {view.state.value}")
    return way
