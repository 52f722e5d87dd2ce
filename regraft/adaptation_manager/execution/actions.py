"""Performs actions on running components."""

from __future__ import annotations

from collections.abc import Callable

from regraft.adaptation_manager.steps.actions import (
    Action,
    Activate,
    ApplyParameters,
    ConnectPort,
    EndSuccessor,
    LeaveStopped,
    ReachState,
    Restore,
    RunProcess,
    RunSuccessor,
    StartAgain,
    TakeOver,
)
from regraft.adaptation_manager.targets.component_client import ControlFailed
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.handover import end_successor, give_back, run_successor, take_over
from regraft.adaptation_manager.targets.processes import end_process, leave_stopped, run_process, start_again, take_part
from regraft.adaptation_manager.targets.rewiring import abandon, move_port
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.lifecycle import Transition, after, route


async def perform(site: ExecutionContext, action: Action, meanwhile: Callable[[], object] | None = None) -> None:
    """Reach the end that ``action`` names; raises ControlFailed where it cannot be reached.

    ``meanwhile`` is called while a component is setting its values.
    """
    if isinstance(action, ApplyParameters):
        await _give_values(site, action, meanwhile)
    elif isinstance(action, ConnectPort):
        await _connect_port(site, action)
    elif isinstance(action, ReachState):
        await _reach_state(site, action)
    elif isinstance(action, RunProcess):
        await run_process(site, action)
    elif isinstance(action, Activate):
        await take_part(site, action)
    elif isinstance(action, RunSuccessor):
        await run_successor(site, action)
    elif isinstance(action, TakeOver):
        await take_over(site, action)
    elif isinstance(action, Restore):
        await give_back(site, action)
    elif isinstance(action, LeaveStopped):
        await leave_stopped(site, action.component, action.host)
    elif isinstance(action, StartAgain):
        await start_again(site, action.component, action.host)
    elif isinstance(action, EndSuccessor):
        await end_successor(site, action)
    else:
        await end_process(site, action.component, action.host)


async def _give_values(site: ExecutionContext, action: ApplyParameters, meanwhile: Callable[[], object] | None) -> None:
    if action.values:
        site.touch(action.component)
        asked = site.controls.set_parameters(action.component, action.values, site.revision)
        if meanwhile is not None:
            meanwhile()
        await asked.view()


async def _connect_port(site: ExecutionContext, action: ConnectPort) -> None:
    view = await site.controls.read(action.component).view()
    await _connect(site, view, action.port, action.topic)


async def _connect(site: ExecutionContext, view: ComponentView, port: str, topic: str) -> None:
    now = view.connections.get(port, "")
    if now == topic:
        await abandon(site, view.component, port)
    elif now:
        await move_port(site, view.component, port, topic)


async def _reach_state(site: ExecutionContext, action: ReachState) -> None:
    view = await site.controls.read(action.component).view()
    if view.state is action.state:
        return
    site.touch(action.component)
    for transition in _way(view, action):
        view = await site.controls.transition(action.component, transition, site.revision, hold=action.hold).view()
        # A process is configured with the connections that it was started with; they may have changed since.
        if transition is Transition.CONFIGURE:
            for port, topic in sorted(action.connections.items()):
                if view.connections.get(port, topic) != topic:
                    await _connect(site, view, port, topic)


def _way(view: ComponentView, action: ReachState) -> tuple[Transition, ...]:
    if action.by is not None:
        if after(view.state, action.by) is not action.state:
            raise ControlFailed(f"{view.component}: {action.by.value} is not possible: it is {view.state.value} by now")
        return (action.by,)
    way = route(view.state, action.state)
    if way is None:
        raise ControlFailed(f"{view.component}: {action.state.value} cannot be reached from {view.state.value}")
    return way
