"""Starts and ends the processes of components, and sees to it that simulated time waits for both."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace

from regraft.adaptation_manager.steps.actions import Activate, RunProcess, StartAgain
from regraft.adaptation_manager.targets.component_client import BESIDE, ControlFailed, NoAnswer, refusal
from regraft.adaptation_manager.targets.context import ExecutionContext
from regraft.adaptation_manager.targets.rewiring import see_through
from regraft.bus.interface import BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.clock import ClockMember, Membership
from regraft.bus_schema.messages.protocol.host import ProcessState, UpdateSpecs
from regraft.bus_schema.model.architecture import ComponentSpec, Restart, RestartPolicy
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.patience import Patience, stretched

LOOK_AGAIN_INTERVAL = 0.01
FIRST_PAUSE = 0.001
"""Seconds after the first look whether a process has ended: most end within ten milliseconds."""
GRACE = 1.0
"""Seconds that a process may take to end by itself when what it was started for is undone."""
KILLED_TIMEOUT = 4.0
"""Seconds after its grace in which a process is gone."""
TOLD_TIMEOUT = 3.0
"""Seconds within which a host knows that a process has ended which is off the bus."""
NOT_RUNNING = (ProcessState.STOPPED, ProcessState.QUARANTINED)
"""Such a process is started by nobody until someone asks for it."""
NOT_YET = RestartPolicy(Restart.NEVER)
"""While a component is being added, its end is the adaptation's failure, not its host's business."""


async def run_process(context: ExecutionContext, action: RunProcess) -> None:
    """Start a component's process and bring it to the state that the action names; raises ControlFailed."""
    spec = action.spec
    state = State.UNCONFIGURED if spec.managed else spec.state
    known = context.before.topics
    topics = tuple(topic for name, topic in context.after.topics.items() if known.get(name) != topic)
    held = replace(spec, state=state, restart=NOT_YET)
    await context.hosts.give(UpdateSpecs(context.revision, (held,), topics=topics, on_trial=(spec.name,)))
    if action.leave_out:
        context.state_lost.add(spec.name)
        await _end_where_it_was(context, spec)
    context.controls.processes |= await context.hosts.start(
        spec.name, spec.host, action.resume, leave_out=action.leave_out, afresh=action.afresh
    )
    patience = Patience(context.start_within(spec))
    await _until_it_runs(context, spec, patience)
    if not spec.managed:
        return
    if _is_in_step(context, spec):
        await _until_it_is_a_member(context, spec, patience)
    if action.state is not State.UNCONFIGURED:
        await _bring(context, spec, Transition.CONFIGURE)


async def _end_where_it_was(context: ExecutionContext, spec: ComponentSpec) -> None:
    """End what a lost host that has joined again meanwhile has started: a later join gets the new place.

    Raises:
        ControlFailed: the run has not ended, or its host does not report it.
    """
    host, name = context.before.components[spec.name].host, spec.name
    patience = Patience(context.before.rules(host).lost_after + KILLED_TIMEOUT)
    for pause in pauses():
        await context.refresh()
        there = [run for at, run in context.hosts.runs(name) if at == host and at != spec.host]
        if host in context.hosts.lost or (host not in context.hosts.silent and not there):
            return
        if patience.is_over():
            raise NoAnswer(f"host {host!r}: {name}, which it may have started as it joined again, has not ended")
        for run in there if context.hosts.is_there(host) else ():
            await context.hosts.stop(name, host, 0.0, run.started_as)
        await context.pause(pause)


async def take_part(context: ExecutionContext, action: Activate) -> None:
    """Wire a component that has just been started, and activate it; raises ControlFailed."""
    view = await context.controls.read(action.component).view()
    if view.state is State.ACTIVE:
        return
    await see_through(context, view)
    await _bring(context, context.after.components[action.component], Transition.ACTIVATE)


def pauses() -> Iterator[float]:
    """Yield the seconds between looks whether a process has ended, for ever: each twice as long as the one before."""
    pause = FIRST_PAUSE
    while True:
        yield pause
        pause = min(2.0 * pause, LOOK_AGAIN_INTERVAL)


async def end_process(context: ExecutionContext, component: str, host: str, grace: float = GRACE) -> None:
    """End a component's process and have its host forget it; does nothing if that is so. Raises ControlFailed."""
    await _release(context, component)
    await context.hosts.give(UpdateSpecs(context.revision, removed=(component,)))
    if host not in context.hosts.which_know(component):
        await context.refresh()
        return
    await context.hosts.stop(component, host, grace)
    patience = Patience(grace + KILLED_TIMEOUT)
    for pause in pauses():
        await context.refresh()
        if host not in context.hosts.silent and host not in context.hosts.which_know(component):
            return
        if patience.is_over():
            raise NoAnswer(f"host {host!r}: {component} has not ended within {grace + KILLED_TIMEOUT:g} s")
        await context.pause(pause)


async def leave_stopped(context: ExecutionContext, component: str, host: str) -> None:
    """End a component's process, and leave it to its host as one that does not run; raises ControlFailed."""
    await _release(context, component)
    await context.hosts.stop(component, host, GRACE)
    patience = Patience(GRACE + KILLED_TIMEOUT)
    for pause in pauses():
        await context.refresh()
        process = context.controls.processes.get(component)
        if host not in context.hosts.silent and (process is None or process.state in NOT_RUNNING):
            return
        if patience.is_over():
            raise NoAnswer(f"host {host!r}: {component} has not ended within {GRACE + KILLED_TIMEOUT:g} s")
        await context.pause(pause)


async def start_again(context: ExecutionContext, action: StartAgain) -> None:
    """Have a component's host start it, and restart it by its policy; raises ControlFailed."""
    name, spec = action.component, context.before.components[action.component]
    if action.unconfigured:
        held = replace(spec, state=State.UNCONFIGURED)
        await context.hosts.give(UpdateSpecs(context.revision, (held,)))
    context.controls.processes |= await context.hosts.start(name, action.host, resume=False)
    if action.unconfigured:
        patience = Patience(context.start_within(spec))
        await _until_it_runs(context, spec, patience)
        if _is_in_step(context, spec):
            await _until_it_is_a_member(context, spec, patience)
        await context.hosts.give(UpdateSpecs(context.revision, (spec,)))


async def _release(context: ExecutionContext, component: str) -> None:
    """Let simulated time continue without a component."""
    process = context.controls.processes.get(component)
    if process is not None and context.before.simulated:
        with contextlib.suppress(ControlFailed):  # a source of time that is gone knows no members any more
            await _membership(context, "release", ClockMember(component, process.incarnation))


async def _until_it_runs(context: ExecutionContext, spec: ComponentSpec, patience: Patience) -> None:
    while True:
        await context.refresh()
        process = context.controls.processes.get(spec.name)
        if process is None or process.state in NOT_RUNNING:
            how = process.exit_reason if process else "its host does not know it any more"
            raise await ended_as_it_started(context, spec, how)
        if process.state is ProcessState.RUNNING and await _answers(context, spec):
            return
        if patience.is_over():
            raise NoAnswer(f"{spec.name}: its process has not come up within {context.start_within(spec):g} s")
        await context.pause(LOOK_AGAIN_INTERVAL)


async def _answers(context: ExecutionContext, spec: ComponentSpec) -> bool:
    if not spec.managed:
        return True
    try:
        await context.controls.read(spec.name).view()
    except NoAnswer:
        return False
    return True


async def ended_as_it_started(context: ExecutionContext, spec: ComponentSpec, how: str) -> ControlFailed:
    """Return that a component's process ended when it had just been started, with its last line of log."""
    line = await context.hosts.last_line(spec.name, spec.host)
    log = f"; its log ends with: {line}" if line else ""
    return ControlFailed(f"{spec.name}: its process ended as it was started: {how or 'nobody knows how'}{log}")


async def _bring(context: ExecutionContext, spec: ComponentSpec, transition: Transition) -> None:
    """Ask for a transition; a new component may take as long as its class states that a handler of it does."""
    context.touch(spec.name)
    within = max(context.bounds.answer, context.after.handler_timeout(spec)) + 1.0
    try:
        await context.controls.transition(spec.name, transition, context.revision, within).view()
    except NoAnswer as error:
        # A process that has just ended is off the bus before its host has heard how it ended.
        patience = Patience(TOLD_TIMEOUT if error.gone else 0.0)
        await context.refresh()
        while context.controls.living(spec.name) is not None:
            if patience.is_over():
                raise
            await context.pause(LOOK_AGAIN_INTERVAL)
            await context.refresh()
        process = context.controls.processes.get(spec.name)
        raise await ended_as_it_started(context, spec, process.exit_reason if process else "") from None


def _is_in_step(context: ExecutionContext, spec: ComponentSpec) -> bool:
    return context.before.simulated and (spec.description is None or spec.description.lockstep)


async def _until_it_is_a_member(context: ExecutionContext, spec: ComponentSpec, patience: Patience) -> None:
    """Wait until simulated time waits for the component, so that it joins at the same tick in every run."""
    process = context.controls.living(spec.name)
    run = ClockMember(spec.name, process.incarnation if process else 0)
    while not await _membership(context, "admit", run):
        if patience.is_over():
            raise NoAnswer(f"{spec.name}: it has not joined simulated time within {context.start_within(spec):g} s")
        await context.pause(LOOK_AGAIN_INTERVAL)
    context.touch(spec.name)


async def go_on_in_step(context: ExecutionContext, name: str) -> None:
    """Let simulated time continue with the current run of a component, in the place of its previous one.

    Raises:
        ControlFailed: the run has ended, or the source of time does not answer.
    """
    spec = context.after.components.get(name) or context.before.components[name]
    if not _is_in_step(context, spec):
        return
    patience = Patience(context.start_within(spec))
    while not await _membership(context, "succeed", ClockMember(name, context.controls.processes[name].incarnation)):
        if patience.is_over():
            raise NoAnswer(f"{name}: simulated time does not include it within {context.start_within(spec):g} s")
        await context.pause(LOOK_AGAIN_INTERVAL)
        await context.refresh()
        if context.controls.living(name) is None:
            raise NoAnswer(f"{name}: it ended before simulated time included it", gone=True)
    context.touch(name)


async def begin_in_step(context: ExecutionContext, name: str) -> None:
    """Take a run into simulated time that continues alone, where another was lost; raises ControlFailed."""
    spec = context.after.components[name]
    if _is_in_step(context, spec):
        await _until_it_is_a_member(context, spec, Patience(context.start_within(spec)))


async def _membership(context: ExecutionContext, verb: str, run: ClockMember) -> bool:
    """Ask the source of time to admit or release a run; returns whether it is a member then. Raises ControlFailed."""
    try:
        run = replace(run, term=context.controls.term)
        answers = await context.kit.ask(
            Keys(context.kit.system).clock(verb), codec.encode(run), stretched(context.bounds.answer)
        )
    except BusError as error:
        raise NoAnswer(f"the source of time: {verb}: {error}") from None
    if not answers:
        raise NoAnswer(f"the source of time: {verb}: no answer within {context.bounds.answer:g} s")
    if answers[0].error:
        raise refusal("the source of time", verb, answers[0])
    try:
        return codec.decode(answers[0].payload, Membership).member
    except BadMessage as error:
        raise ControlFailed(f"the source of time: {verb}: a reply that cannot be read: {error}") from None


async def end_removed(
    context: ExecutionContext, removed: tuple[ComponentSpec, ...], tell: Callable[[str, str], object]
) -> bool:
    """End what an applied adaptation removed; failures are reported. Returns whether all has ended."""
    ended = [await _end_or_tell(context, spec.name, spec.host, 3.0, tell) for spec in removed]
    return all(ended)


async def end_strangers(context: ExecutionContext, tell: Callable[[str, str], object]) -> bool:
    """End what runs and is in the architecture no more; failures are reported. Returns whether all has ended.

    A manager died, or a host was silent, when it was to end.
    """
    await context.refresh()
    known = {name for name in context.controls.processes if not name.endswith(BESIDE)}
    names = sorted(known - context.after.components.keys() - {context.kit.name})
    there = [(name, host) for name in names for host in context.hosts.which_know(name)]
    ended = [await _end_or_tell(context, name, host, GRACE, tell) for name, host in there]
    return all(ended) and not any(
        host in context.hosts.silent for name in names for host, _ in context.hosts.runs(name)
    )


async def _end_or_tell(
    context: ExecutionContext, name: str, host: str, grace: float, tell: Callable[[str, str], object]
) -> bool:
    try:
        await end_process(context, name, host, grace)
    except ControlFailed as error:
        tell("adaptation.unfinished", f"{name} is not in the architecture any more, but has not ended: {error}")
        return False
    return True
