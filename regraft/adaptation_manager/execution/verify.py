"""Phase 4: the hosts get the new specs, and the components are read back: they must be as planned."""

from __future__ import annotations

from collections.abc import Mapping

from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.steps.actions import (
    Action,
    Activate,
    ApplyParameters,
    ConnectPort,
    LeaveStopped,
    ReachState,
    RunProcess,
    RunSuccessor,
    StayDown,
    TakeOver,
)
from regraft.adaptation_manager.targets.component_client import ControlFailed, NoAnswer, PendingQuery
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.host_client import Update
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State, is_at_most, is_lower


async def verify(plan: Plan, context: ExecutionContext, update: Update) -> None:
    """Wait until the hosts have the new specs, and read every component of the plan back.

    A component that was restarted meanwhile is as good as any other, if it came back as planned. It is read while its
    host gets the specs. A host that names the run that was read has the new specs for all later ones. Where only values
    were given, the answers to that are the reading back.

    Raises:
        ControlFailed: with everything that is not as it should be, or a host that did not take the specs.
    """
    staying = {name for name, spec in plan.after.components.items() if spec.managed}
    followed = _followed(plan) & staying
    names = sorted({step.component for step in plan.steps} & staying | followed)
    reading = {} if plan.only_gives_values else {name: context.controls.read(name) for name in names}
    context.controls.processes |= await update.processes()
    wrong = []
    for name in names:
        limit = plan.after.components[name].state if name in followed else _limit(plan, name)
        try:
            view = await _newest_view(context, name, reading.get(name))
        except NoAnswer as error:
            if limit is None or not error.gone:
                raise
            continue  # its host starts it, if at all, as planned
        wanted = {"state": limit.value} if limit and name in followed else _wanted_of(plan, name)
        if limit is not None and is_at_most(view.state, limit):
            wanted.pop("state", None)
        wrong += differences(view, wanted)
    if wrong:
        raise ControlFailed(f"read back after the change: {'; '.join(wrong)}")


def _followed(plan: Plan) -> set[str]:
    """Return the components without a step that were as low as they are to be: the architecture only follows.

    One of them may have ended meanwhile, and run again by its earlier spec.
    """
    before, after = plan.before.components, plan.after.components
    lowered = {name for name in before.keys() & after.keys() if is_lower(after[name].state, before[name].state)}
    return lowered - {step.component for step in plan.steps}


def _limit(plan: Plan, name: str) -> State | None:
    """Return the state that a component may be below, if all that was asked of it is to do less; else None.

    Such a component may have no process either.
    """
    actions = [step.do for step in plan.steps if step.component == name]
    downward = [
        action
        for action in actions
        if isinstance(action, StayDown) or (isinstance(action, ReachState) and action.leads_down)
    ]
    return downward[-1].state if len(downward) == len(actions) else None


async def _newest_view(context: ExecutionContext, name: str, asked: PendingQuery | None) -> ComponentView:
    if asked is None:
        view = context.controls.last_answer(name, context.after.components[name].host)
        if view is not None:
            return view
        await context.refresh()
    elif context.controls.is_living(asked):
        try:
            return await asked.view()
        except NoAnswer as error:
            if not error.gone:
                raise
            await context.refresh()
    return await context.controls.read(name).view()


def differences(view: ComponentView, wanted: Mapping[str, object]) -> list[str]:
    """Return where a component is not as it is ``wanted``: its ``state``, ``parameters.NAME``, ``connections.PORT``.

    Fields that it does not have, and ports without a connection, are left out.
    """
    found: dict[str, object] = {"state": view.state.value}
    found |= {f"parameters.{name}": value for name, value in view.parameters.items()}
    found |= {f"connect.{name}": topic for name, topic in view.connections.items() if topic != ""}
    return [
        f"{view.component}: {where} is {found[where]!r}, should be {_plain(value)!r}"
        for where, value in wanted.items()
        if where in found and not _agrees(found[where], _plain(value))
    ]


def _agrees(found: object, wanted: object) -> bool:
    """Return whether a value is as it is wanted; a component reports records with the defaults that were left out."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        return all(key in found and _agrees(found[key], value) for key, value in wanted.items())
    if isinstance(found, list) and isinstance(wanted, list | tuple):
        return len(found) == len(wanted) and all(map(_agrees, found, wanted))
    return found == wanted


def _wanted_of(plan: Plan, name: str) -> dict[str, object]:
    wanted: dict[str, object] = {}
    for step in plan.steps:
        if step.component == name:
            wanted |= _wanted(step.do)
    return wanted


def _wanted(action: Action) -> dict[str, object]:
    if isinstance(action, ApplyParameters):
        return {f"parameters.{name}": value for name, value in action.values.items()}
    if isinstance(action, ConnectPort):
        return {f"connect.{action.port}": action.topic}
    if isinstance(action, Activate):
        return {"state": State.ACTIVE.value}
    if isinstance(action, LeaveStopped | StayDown):
        return {}  # something is started in its place, or it has seen to it itself
    if isinstance(action, RunSuccessor):
        values = {f"parameters.{name}": value for name, value in _same_anywhere(action.spec)}
        return values | {f"connect.{port}": topic for port, topic in action.spec.connections.items()}
    assert isinstance(action, ReachState | RunProcess | TakeOver)
    return {"state": action.state.value}


def _same_anywhere(spec: ComponentSpec) -> list[tuple[str, object]]:
    """Return the parameters of a spec, without paths: each host has folders of its own."""
    paths = {p.name for p in spec.description.parameters if p.names_files} if spec.description else set()
    return [(name, value) for name, value in spec.parameters.items() if name not in paths]


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value
