"""Hands a component over from one of its runs to another, and back: nothing is lost, nothing is doubled.

The runs do it between them (``regraft.runtime.handover.protocol``). This is the order in which they are asked, and what
follows when one of them fails. A run is known by the incarnation as which it was started: under that it always answers.
"""

from __future__ import annotations

import time

from regraft.adaptation_manager.steps.actions import EndSuccessor, Restore, RunSuccessor, TakeOver
from regraft.adaptation_manager.targets.component_client import BESIDE, ControlFailed, NoAnswer
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.processes import (
    KILLED_TIMEOUT,
    LOOK_AGAIN_INTERVAL,
    begin_in_step,
    ended_as_it_started,
    go_on_in_step,
    pauses,
)
from regraft.adaptation_manager.targets.rewiring import see_through
from regraft.bus_schema.messages.protocol.control import ComponentView, ControlCode
from regraft.bus_schema.messages.protocol.handover import Handover, HandoverStep, Role
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus, UpdateSpecs
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.patience import Patience

TAKE_OVER_TIMEOUT = 1.5
"""Seconds, beyond the longest handler of both, that a run may take to answer when it is to take over."""
LOOK_AT_HOST_TIMEOUT = 0.05
"""Seconds between two looks whether a process is still there whose token is waited for."""
LOST_TIMEOUT = 3.0
"""Seconds, beyond those after which a silent host counts as lost, within which that is known."""
WITHOUT_MERCY = 0.0


async def run_successor(context: ExecutionContext, action: RunSuccessor) -> None:
    """Start a successor next to a component's run and wait until it is ready; raises ControlFailed."""
    name, spec = action.component, action.spec
    patience = Patience(context.start_within(spec))
    await context.hosts.succeed(spec, action.incumbent, context.before.components[name].host, action.with_state)
    _note(context, name)
    successor = await _until_ready(context, spec, patience)
    view = await context.controls.hand_over(name, successor.started_as, Handover(HandoverStep.READ)).view()
    problems = view.detail.get("problems", [])
    if problems:
        raise ControlFailed(f"{name}: the successor cannot take over: {'; '.join(map(str, problems))}")


async def _until_ready(context: ExecutionContext, spec: ComponentSpec, patience: Patience) -> ProcessStatus:
    """Wait for the token of the run next to a component."""
    look_at = time.monotonic() + LOOK_AT_HOST_TIMEOUT
    tokens = context.controls.remembered
    while True:
        known = tokens.news
        successor = _beside(context, spec.name)
        if successor is None or successor.state in (ProcessState.STOPPED, ProcessState.QUARANTINED):
            raise await ended_as_it_started(context, spec, successor.exit_reason if successor else "")
        if tokens.stands_by(spec.name, successor.started_as):
            return successor
        if patience.is_over():
            raise NoAnswer(f"{spec.name}: its successor is not ready within {context.start_within(spec):g} s")
        await context.kit.compute(tokens.wait_for_news, known, LOOK_AT_HOST_TIMEOUT)
        if time.monotonic() > look_at:
            look_at = time.monotonic() + LOOK_AT_HOST_TIMEOUT
            await context.refresh()
            if spec.host in context.hosts.silent and not context.hosts.is_there(spec.host):
                raise NoAnswer(
                    f"{spec.name}: {context.hosts.why_not_there(spec.host)}, and with it the successor", gone=True
                )


async def take_over(context: ExecutionContext, action: TakeOver) -> None:
    """Have the successor that is ready continue in the place of the incumbent, which is frozen then; ControlFailed."""
    name = action.component
    successor = _beside(context, name)
    if successor is None:
        raise NoAnswer(f"{name}: its successor has ended", gone=True)
    view = await context.controls.read(f"{name}{BESIDE}").view()
    await see_through(context, view, f"{name}{BESIDE}")
    context.touch(name)
    step = Handover(HandoverStep.TAKE_OVER, revision=context.revision)
    try:
        taken = await _hand_over(context, name, successor.started_as, step, _takes(context, name))
    except ControlFailed as error:
        if error.code is not ControlCode.TIMED_OUT or await _is_there(context, name, action.incumbent):
            raise
        await _promote(context, action, successor)
        await _speaks_now(context, action, successor)
        await begin_in_step(context, name)
        return
    await _speaks_now(context, action, successor)
    await go_on_in_step(context, name)
    _tell_gap(context, name, taken)


async def _speaks_now(context: ExecutionContext, action: TakeOver, successor: ProcessStatus) -> None:
    """Notify the host of the successor, and that of the incumbent if it is another, that the former speaks now."""
    name, target = action.component, context.after.components[action.component].host
    await _let_speak(context, name, target, successor.started_as)
    if action.host != target:
        try:
            await _step_aside(context, name, action.host, target, successor.started_as)
        except NoAnswer as error:
            # The run there is frozen, or has ended: it is updated when its host is heard again.
            context.kit.log.warning("%s: its former host has not heard that it is moved: %s", name, error)


def _tell_gap(context: ExecutionContext, name: str, taken: ComponentView) -> None:
    """Report how long the exclusive resource was held by neither run."""
    description = context.after.components[name].description
    silent = taken.detail.get("silent")
    if description is not None and description.exclusive and isinstance(silent, int | float):
        text = f"{name}: from letting go to taking hold, nobody spoke for it for {silent * 1000:.0f} ms"
        context.kit.event("adaptation.gap", text, seconds=silent)


async def _promote(context: ExecutionContext, action: TakeOver, successor: ProcessStatus) -> None:
    """Let the successor continue alone, from the last checkpoint if there is one: the incumbent died, or hangs."""
    name = action.component
    await _end_run(context, name, action.host, action.incumbent)
    known = (action.incumbent, successor.started_as)
    if any(host == action.host and run.started_as not in known for host, run in context.hosts.runs(name)):
        raise ControlFailed(f"{name}: run {action.incumbent} was lost as it handed over, and has been restarted")
    step = Handover(HandoverStep.PROMOTE, revision=context.revision)
    await _hand_over(context, name, successor.started_as, step, _takes(context, name))
    context.state_lost.add(name)


async def give_back(context: ExecutionContext, action: Restore) -> None:
    """Have the former run speak for the component again, in any state of its successor; raises ControlFailed."""
    name = action.component
    its_host_answers = await _hear(context, action.host)
    context.touch(name)
    former, successor = _both(context, action)
    if not its_host_answers:
        # The component is lost with its host, as it would have been without the adaptation.
        await _end_successor(context, action, successor)
    elif former is None:
        await _begin_again(context, action, successor)
    elif await _role(context, name, former.started_as) is Role.LIVE:
        await _stay(context, action, former, successor)
    else:
        await _wake(context, action, former, successor)


def _both(context: ExecutionContext, action: Restore) -> tuple[ProcessStatus | None, ProcessStatus | None]:
    """Return the previous run and its successor, None for one that has ended."""
    target = action.successor_host or action.host
    former = successor = None
    for host, run in context.hosts.runs(action.component):
        if host == action.host and run.started_as == action.incumbent:
            former = run
        elif host == target:
            successor = run
    return former, successor


async def _stay(
    context: ExecutionContext, action: Restore, former: ProcessStatus, successor: ProcessStatus | None
) -> None:
    """Give up the successor of a run that never stopped speaking."""
    name = action.component
    try:
        await _end_successor(context, action, successor, patient=False)
    except NoAnswer as error:
        # It only waits, and will wait in vain: its host ends it if it is cut off, or is asked again later.
        context.kit.log.warning("%s: its successor has not ended yet: %s", name, error)
        context.unfinished = True
    # A successor that has just ended may have asked already: what it asked for must not be done any more.
    barred = max(former.max_incarnation, successor.started_as if successor is not None else 0)
    bar = Handover(HandoverStep.RESUME, barred)
    await context.controls.hand_over(name, former.started_as, bar).view()
    await _let_speak(context, name, action.host, former.started_as)


async def _wake(
    context: ExecutionContext, action: Restore, former: ProcessStatus, successor: ProcessStatus | None
) -> None:
    """Have a frozen run continue: from its successor's living state if that can hand it over, else from its own."""
    name = action.component
    if successor is not None and await _is_live(context, name, successor.started_as):
        anew = await _renamed(context, action, former)
        step = Handover(HandoverStep.TAKE_OVER, successor.incarnation, anew, revision=context.revision)
        try:
            await _hand_over(context, name, former.started_as, step, _takes(context, name))
        except ControlFailed as error:
            context.kit.log.warning("%s: the state of now could not be handed back: %s", name, error)
        else:
            await _go_on_if_there_is_time(context, name)
            await _end_successor(context, action, successor)
            await context.refresh()
            return
    await _end_successor(context, action, successor)
    anew = await _renamed(context, action, former)
    peer = successor.started_as if successor is not None else 0
    step = Handover(HandoverStep.RESUME, peer, anew, revision=context.revision)
    await _hand_over(context, name, former.started_as, step, _takes(context, name))
    await _go_on_if_there_is_time(context, name)
    await context.refresh()


async def _go_on_if_there_is_time(context: ExecutionContext, name: str) -> None:
    """Let simulated time continue with a run; to a source of time that is gone, it comes back by itself."""
    try:
        await go_on_in_step(context, name)
    except ControlFailed as error:
        context.kit.log.warning("%s: simulated time does not include it yet: %s", name, error)


async def _renamed(context: ExecutionContext, action: Restore, former: ProcessStatus) -> int:
    """Give the host the incarnation of a run before it speaks: its heartbeats must be known."""
    name = action.component
    above = max(run.incarnation for run in (former, *(run for _, run in context.hosts.runs(name))))
    await _let_speak(context, name, action.host, former.started_as, above)
    return next(run.incarnation for _, run in context.hosts.runs(name) if run.started_as == former.started_as)


async def _begin_again(context: ExecutionContext, action: Restore, successor: ProcessStatus | None) -> None:
    """Start the component as it was before: the previous run has ended, as any component may at any time."""
    name = action.component
    await _end_successor(context, action, successor)
    spec = context.before.components[name]
    patience = Patience(context.start_within(spec))
    moved = action.successor_host not in ("", action.host)
    if moved:
        await context.hosts.give(UpdateSpecs(context.revision, (spec,)))
    while True:
        await context.refresh()
        process = context.controls.processes.get(name)
        if process is not None and process.state is ProcessState.RUNNING:
            return
        if process is None or process.state in (ProcessState.STOPPED, ProcessState.QUARANTINED):
            await context.hosts.start(name, action.host, resume=moved)
            _note(context, name)
        if patience.is_over():
            raise NoAnswer(f"{spec.name}: it has not come back within {context.start_within(spec):g} s")
        await context.pause(LOOK_AGAIN_INTERVAL)


async def end_successor(context: ExecutionContext, action: EndSuccessor) -> None:
    """End the standby run of a component, if there is one. Raises ControlFailed."""
    name = action.component
    home = context.before.components[name].host
    await context.refresh()
    runs = context.hosts.runs(name)
    for host, run in runs:
        if host != action.host or run.started_as == action.incumbent or (host == home and not _is_beside(context, run)):
            continue
        try:
            await _end_run(context, name, host, run.started_as, patient=False)
        except NoAnswer as error:
            if host == home:
                raise
            context.kit.log.warning("%s: its successor has not ended yet: %s", name, error)
            context.unfinished = True
    is_there = action.incumbent in (run.started_as for host, run in runs if host == home)
    if home != action.host and is_there and await _hear(context, home):
        await _let_speak(context, name, home, action.incumbent)


async def retire(context: ExecutionContext, name: str, host: str, grace: float) -> None:
    """End the run next to a component, which nobody will ask to continue any more; raises ControlFailed."""
    home, speaks = context.after.components[name].host, context.controls.processes.get(name)
    for where, run in context.hosts.runs(name):
        if where != host or (where == home and not _is_beside(context, run)):
            continue
        if where != home:
            await _step_aside(context, name, where, home, speaks.started_as if speaks else 0)
        await _end_run(context, name, where, run.started_as, grace, patient=False)


async def _end_successor(
    context: ExecutionContext, action: Restore, successor: ProcessStatus | None, *, patient: bool = True
) -> None:
    if successor is None:
        return
    name, host = action.component, action.successor_host or action.host
    if host != action.host and (not patient or await _hear(context, host)):
        await _step_aside(context, name, host, action.host, action.incumbent)
    await _end_run(context, name, host, successor.started_as, patient=patient)


async def _end_run(
    context: ExecutionContext,
    name: str,
    host: str,
    started_as: int,
    grace: float = WITHOUT_MERCY,
    *,
    patient: bool = True,
) -> None:
    """End one run for certain; raises ControlFailed. ``patient``: a host that is silent is waited for until it is lost.

    A run of a lost host that took part in an adaptation has ended: the host ensures that itself.
    """
    patience = Patience(grace + KILLED_TIMEOUT)
    if patient and not await _hear(context, host):
        return
    await context.hosts.stop(name, host, grace, started_as)
    for pause in pauses():
        await context.refresh()
        its_host_answers = host not in context.hosts.silent
        if its_host_answers and (host, started_as) not in (
            (at, run.started_as) for at, run in context.hosts.runs(name)
        ):
            return
        if not its_host_answers and patient and not await _hear(context, host):
            return
        if patience.is_over():
            raise NoAnswer(
                f"host {host!r}: run {started_as} of {name} has not ended within {grace + KILLED_TIMEOUT:g} s"
            )
        await context.pause(pause)


async def _hear(context: ExecutionContext, host: str) -> bool:
    """Wait until a host answers, or is lost; returns whether it answers. Raises ControlFailed if neither comes."""
    patience = Patience(context.before.rules(host).lost_after + LOST_TIMEOUT)
    while True:
        await context.refresh()
        if host in context.hosts.lost:
            return False
        if host not in context.hosts.silent:
            return True
        if patience.is_over():
            raise NoAnswer(context.hosts.why_not_there(host))
        await context.pause(LOOK_AT_HOST_TIMEOUT)


# --- who there is ---


def _beside(context: ExecutionContext, name: str) -> ProcessStatus | None:
    return context.controls.processes.get(f"{name}{BESIDE}")


def _is_beside(context: ExecutionContext, run: ProcessStatus) -> bool:
    """Return whether a component has a standby run."""
    beside = _beside(context, run.component)
    return beside is not None and beside.started_as == run.started_as


def _note(context: ExecutionContext, name: str) -> None:
    """Take the hosts' reports of a component, also that it has no standby run any more."""
    context.controls.processes.pop(f"{name}{BESIDE}", None)
    context.controls.processes |= context.hosts.known(name)


async def _let_speak(
    context: ExecutionContext, name: str, host: str, started_as: int, above: int | None = None
) -> None:
    """Notify a host that a run of its own speaks for a component; raises ControlFailed."""
    await context.hosts.let_speak(name, host, started_as, above)
    _note(context, name)


async def _step_aside(context: ExecutionContext, name: str, host: str, home: str, started_as: int) -> None:
    """Notify a host that a run of another one, its ``home``, speaks for a component; raises ControlFailed."""
    await context.hosts.let_speak(name, host, started_as, elsewhere=home)
    _note(context, name)


async def _hand_over(
    context: ExecutionContext, name: str, started_as: int, step: Handover, within: float
) -> ComponentView:
    return await context.controls.hand_over(name, started_as, step, within).view()


def _takes(context: ExecutionContext, name: str) -> float:
    """Return the seconds within which a step of a hand-over is answered."""
    specs = [spec for plan in (context.before, context.after) if (spec := plan.components.get(name)) is not None]
    longest = max((context.after.handler_timeout(spec) for spec in specs), default=0.0)
    # One run after the other releases and takes hold, each by its own methods.
    exclusive = [spec for spec in specs if spec.description is not None and spec.description.exclusive]
    hooks = sum(2 * context.after.handler_timeout(spec) for spec in exclusive)
    return max(context.bounds.answer, TAKE_OVER_TIMEOUT) + longest + hooks


async def _role(context: ExecutionContext, name: str, started_as: int) -> Role:
    view = await context.controls.hand_over(name, started_as, Handover(HandoverStep.READ)).view()
    return Role(view.detail.get("role"))


async def _is_there(context: ExecutionContext, name: str, started_as: int) -> bool:
    try:
        await _role(context, name, started_as)
    except NoAnswer:
        return False
    return True


async def _is_live(context: ExecutionContext, name: str, started_as: int) -> bool:
    try:
        view = await _hand_over(context, name, started_as, Handover(HandoverStep.READ), context.bounds.answer)
    except ControlFailed:
        return False
    return view.detail.get("role") == Role.LIVE.value and view.state in (State.ACTIVE, State.INACTIVE)
