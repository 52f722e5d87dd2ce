"""Starts and ends the processes of components, and sees to it that simulated time waits for both."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace

from regraft.adaptation_manager.steps.actions import Activate, RunProcess
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


async def run_process(site: ExecutionContext, action: RunProcess) -> None:
    """Start a component's process and bring it to the state that the action names; raises ControlFailed."""
    spec = action.spec
    state = State.UNCONFIGURED if spec.managed else spec.state
    known = site.before.topics
    topics = tuple(topic for name, topic in site.after.topics.items() if known.get(name) != topic)
    held = replace(spec, state=state, restart=NOT_YET)
    await site.hosts.give(UpdateSpecs(site.revision, (held,), topics=topics))
    if action.leave_out:
        site.state_lost.add(spec.name)
    site.controls.processes |= await site.hosts.start(
        spec.name, spec.host, action.resume, leave_out=action.leave_out, afresh=action.afresh
    )
    patience = Patience(site.start_within(spec))
    await _until_it_runs(site, spec, patience)
    if not spec.managed:
        return
    if _is_in_step(site, spec):
        await _until_it_is_a_member(site, spec, patience)
    if action.state is not State.UNCONFIGURED:
        await _bring(site, spec, Transition.CONFIGURE)


async def take_part(site: ExecutionContext, action: Activate) -> None:
    """Wire a component that has just been started, and activate it; raises ControlFailed."""
    view = await site.controls.read(action.component).view()
    if view.state is State.ACTIVE:
        return
    await see_through(site, view)
    await _bring(site, site.after.components[action.component], Transition.ACTIVATE)


async def end_process(site: ExecutionContext, component: str, host: str, grace: float = GRACE) -> None:
    """End a component's process and have its host forget it; does nothing if that is so. Raises ControlFailed."""
    await _release(site, component)
    processes = await site.hosts.give(UpdateSpecs(site.revision, removed=(component,)))
    if component not in processes:
        await site.refresh()
        return
    await site.hosts.stop(component, host, grace)
    patience = Patience(grace + KILLED_TIMEOUT)
    while True:
        await site.refresh()
        if component not in site.controls.processes and host not in site.hosts.silent:
            return
        if patience.is_over():
            raise NoAnswer(f"host {host!r}: {component} has not ended within {grace + KILLED_TIMEOUT:g} s")
        await site.pause(LOOK_AGAIN_INTERVAL)


async def leave_stopped(site: ExecutionContext, component: str, host: str) -> None:
    """End a component's process, and leave it to its host as one that does not run; raises ControlFailed."""
    await _release(site, component)
    await site.hosts.stop(component, host, GRACE)
    patience = Patience(GRACE + KILLED_TIMEOUT)
    while True:
        await site.refresh()
        process = site.controls.processes.get(component)
        if host not in site.hosts.silent and (process is None or process.state in NOT_RUNNING):
            return
        if patience.is_over():
            raise NoAnswer(f"host {host!r}: {component} has not ended within {GRACE + KILLED_TIMEOUT:g} s")
        await site.pause(LOOK_AGAIN_INTERVAL)


async def start_again(site: ExecutionContext, component: str, host: str) -> None:
    """Have a component's host start it, and restart it as its policy says; raises ControlFailed."""
    site.controls.processes |= await site.hosts.start(component, host, resume=False)


async def _release(site: ExecutionContext, component: str) -> None:
    """Let simulated time go on without a component."""
    process = site.controls.processes.get(component)
    if process is not None and site.before.simulated:
        with contextlib.suppress(ControlFailed):  # a source of time that is gone knows no members any more
            await _membership(site, "release", ClockMember(component, process.incarnation))


async def _until_it_runs(site: ExecutionContext, spec: ComponentSpec, patience: Patience) -> None:
    while True:
        await site.refresh()
        process = site.controls.processes.get(spec.name)
        if process is None or process.state in NOT_RUNNING:
            how = process.exit_reason if process else "its host does not know it any more"
            raise await ended_as_it_started(site, spec, how)
        if process.state is ProcessState.RUNNING and await _answers(site, spec):
            return
        if patience.is_over():
            raise NoAnswer(f"{spec.name}: its process has not come up within {site.start_within(spec):g} s")
        await site.pause(LOOK_AGAIN_INTERVAL)


async def _answers(site: ExecutionContext, spec: ComponentSpec) -> bool:
    if not spec.managed:
        return True
    try:
        await site.controls.read(spec.name).view()
    except NoAnswer:
        return False
    return True


async def ended_as_it_started(site: ExecutionContext, spec: ComponentSpec, how: str) -> ControlFailed:
    """Return that a component's process ended when it had just been started, and the last that it said."""
    line = await site.hosts.last_line(spec.name, spec.host)
    log = f"; its log ends with: {line}" if line else ""
    return ControlFailed(f"{spec.name}: its process ended as it was started: {how or 'nobody knows how'}{log}")


async def _bring(site: ExecutionContext, spec: ComponentSpec, transition: Transition) -> None:
    """Ask for a transition; a new component may take as long as its class says that a handler of it does."""
    site.touch(spec.name)
    within = max(site.bounds.answer, site.after.handler_timeout(spec)) + 1.0
    try:
        await site.controls.transition(spec.name, transition, site.revision, within).view()
    except NoAnswer as error:
        # A process that has just ended is off the bus before its host has heard how it ended.
        patience = Patience(TOLD_TIMEOUT if error.gone else 0.0)
        await site.refresh()
        while site.controls.living(spec.name) is not None:
            if patience.is_over():
                raise
            await site.pause(LOOK_AGAIN_INTERVAL)
            await site.refresh()
        process = site.controls.processes.get(spec.name)
        raise await ended_as_it_started(site, spec, process.exit_reason if process else "") from None


def _is_in_step(site: ExecutionContext, spec: ComponentSpec) -> bool:
    return site.before.simulated and (spec.description is None or spec.description.lockstep)


async def _until_it_is_a_member(site: ExecutionContext, spec: ComponentSpec, patience: Patience) -> None:
    """Wait until simulated time goes on only with the component, so that it joins at the same tick in every run."""
    process = site.controls.living(spec.name)
    run = ClockMember(spec.name, process.incarnation if process else 0)
    while not await _membership(site, "admit", run):
        if patience.is_over():
            raise NoAnswer(f"{spec.name}: it has not joined simulated time within {site.start_within(spec):g} s")
        await site.pause(LOOK_AGAIN_INTERVAL)
    site.touch(spec.name)


async def go_on_in_step(site: ExecutionContext, name: str) -> None:
    """Let simulated time go on with the run that now speaks for a component, in the place of the one before it.

    Raises:
        ControlFailed: the run has ended, or the source of time does not answer.
    """
    spec = site.after.components.get(name) or site.before.components[name]
    if not _is_in_step(site, spec):
        return
    patience = Patience(site.start_within(spec))
    while not await _membership(site, "succeed", ClockMember(name, site.controls.processes[name].incarnation)):
        if patience.is_over():
            raise NoAnswer(f"{name}: simulated time does not go on with it within {site.start_within(spec):g} s")
        await site.pause(LOOK_AGAIN_INTERVAL)
        await site.refresh()
        if site.controls.living(name) is None:
            raise NoAnswer(f"{name}: it has ended as it was to go on in simulated time", gone=True)
    site.touch(name)


async def begin_in_step(site: ExecutionContext, name: str) -> None:
    """Take a run into simulated time that goes on alone, where another was lost; raises ControlFailed."""
    spec = site.after.components[name]
    if _is_in_step(site, spec):
        await _until_it_is_a_member(site, spec, Patience(site.start_within(spec)))


async def _membership(site: ExecutionContext, verb: str, run: ClockMember) -> bool:
    """Ask the source of time to admit or release a run; returns whether it is a member then. Raises ControlFailed."""
    try:
        run = replace(run, term=site.controls.term)
        answers = await site.kit.ask(
            Keys(site.kit.system).clock(verb), codec.encode(run), stretched(site.bounds.answer)
        )
    except BusError as error:
        raise NoAnswer(f"the source of time: {verb}: {error}") from None
    if not answers:
        raise NoAnswer(f"the source of time: {verb}: no answer within {site.bounds.answer:g} s")
    if answers[0].error:
        raise refusal("the source of time", verb, answers[0])
    try:
        return codec.decode(answers[0].payload, Membership).member
    except BadMessage as error:
        raise ControlFailed(f"the source of time: {verb}: a reply that cannot be read: {error}") from None


async def end_removed(
    site: ExecutionContext, removed: tuple[ComponentSpec, ...], tell: Callable[[str, str], object]
) -> bool:
    """End what an applied adaptation removed; what fails is told. Returns whether all has ended."""
    ended = [await _end_or_tell(site, spec.name, spec.host, 3.0, tell) for spec in removed]
    return all(ended)


async def end_strangers(site: ExecutionContext, tell: Callable[[str, str], object]) -> bool:
    """End what runs and is in the architecture no more; what fails is told. Returns whether all has ended.

    A manager died, or a host was silent, when it was to end.
    """
    await site.refresh()
    known = {name for name in site.controls.processes if not name.endswith(BESIDE)}
    names = sorted(known - site.after.components.keys() - {site.kit.name})
    hosts = [host for host in site.hosts.names if host not in site.hosts.silent]
    ended = [await _end_or_tell(site, name, host, GRACE, tell) for name in names for host in hosts]
    return all(ended)


async def _end_or_tell(
    site: ExecutionContext, name: str, host: str, grace: float, tell: Callable[[str, str], object]
) -> bool:
    try:
        await end_process(site, name, host, grace)
    except ControlFailed as error:
        tell("adaptation.unfinished", f"{name} is not in the architecture any more, but has not ended: {error}")
        return False
    return True
