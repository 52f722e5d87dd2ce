"""Hands a component over from one of its runs to another, and back: nothing is lost, nothing is doubled.

The runs do it between them (``regraft.runtime.handover``); this is the order in which they are asked, and what is done
when one of them does not do its part. A run is known by the incarnation as which it was started, whatever it is called
since: under that it always answers.
"""

from __future__ import annotations

import time

from adaptation_manager.controls import BESIDE, ControlFailed, NoAnswer
from adaptation_manager.processes import (
    KILLED_WITHIN,
    LOOK_AGAIN_AFTER,
    begin_in_step,
    ended_as_it_started,
    go_on_in_step,
)
from adaptation_manager.rewiring import see_through
from adaptation_manager.site import Site
from adaptation_manager.steps.actions import EndSuccessor, GiveBack, RunSuccessor, TakeOver
from bus_schema.architecture import ComponentSpec
from bus_schema.lifecycle import State
from bus_schema.messages.control import ComponentView, ControlCode
from bus_schema.messages.handover import Handover, HandoverStep, Role
from bus_schema.messages.host import ProcessState, ProcessStatus

TAKE_OVER_WITHIN = 1.5
"""Seconds, beyond the longest handler of both, that a run may take to answer when it is to take over."""
LOOK_AT_HOST_AFTER = 0.05
"""Seconds between two looks whether a process is still there whose token is waited for."""
WITHOUT_MERCY = 0.0


async def run_successor(site: Site, action: RunSuccessor) -> None:
    """Start a successor beside a component's run and wait until it is ready; raises ControlFailed."""
    name, spec = action.component, action.spec
    deadline = time.monotonic() + site.bounds.start
    _note(site, name, await site.hosts.succeed(spec, action.incumbent, action.with_state))
    successor = await _until_ready(site, spec, deadline)
    view = await site.controls.hand_over(name, successor.begun, Handover(HandoverStep.READ)).view()
    problems = view.detail.get("problems", [])
    if problems:
        raise ControlFailed(f"{name}: the successor cannot take over: {'; '.join(map(str, problems))}")


async def _until_ready(site: Site, spec: ComponentSpec, deadline: float) -> ProcessStatus:
    """Wait for the token of the run beside a component."""
    look_at = time.monotonic() + LOOK_AT_HOST_AFTER
    while True:
        successor = _beside(site, spec.name)
        if successor is None or successor.state in (ProcessState.STOPPED, ProcessState.QUARANTINED):
            raise await ended_as_it_started(site, spec, successor.last_end if successor else "")
        if site.controls.remembered.stands_by(spec.name, successor.begun):
            return successor
        if time.monotonic() > deadline:
            raise NoAnswer(f"{spec.name}: its successor is not ready within {site.bounds.start:g} s")
        await site.pause(LOOK_AGAIN_AFTER)
        if time.monotonic() > look_at:
            look_at = time.monotonic() + LOOK_AT_HOST_AFTER
            await site.refresh()


async def take_over(site: Site, action: TakeOver) -> None:
    """Have the successor that is ready go on in the place of the incumbent, which is frozen then; ControlFailed."""
    name = action.component
    successor = _beside(site, name)
    if successor is None:
        raise NoAnswer(f"{name}: its successor has ended", gone=True)
    view = await site.controls.read(f"{name}{BESIDE}").view()
    await see_through(site, view, f"{name}{BESIDE}")
    site.touch(name)
    step = Handover(HandoverStep.TAKE_OVER, revision=site.revision)
    try:
        taken = await _hand_over(site, name, successor.begun, step, _takes(site, name))
    except ControlFailed as error:
        if error.code is not ControlCode.TIMED_OUT or await _is_there(site, name, action.incumbent):
            raise
        await _promote(site, action, successor)
        await _let_speak(site, name, action.host, successor.begun)
        await begin_in_step(site, name)
        return
    await _let_speak(site, name, action.host, successor.begun)
    await go_on_in_step(site, name)
    _tell_gap(site, name, taken)


def _tell_gap(site: Site, name: str, taken: ComponentView) -> None:
    """Tell for how long nobody held what only one can hold at a time."""
    description = site.after.components[name].description
    silent = taken.detail.get("silent")
    if description is not None and description.exclusive and isinstance(silent, int | float):
        text = f"{name}: from letting go to taking hold, nobody spoke for it for {silent * 1000:.0f} ms"
        site.kit.event("adaptation.gap", text, seconds=silent)


async def _promote(site: Site, action: TakeOver, successor: ProcessStatus) -> None:
    """Let the successor go on alone, from the last checkpoint if there is one: the incumbent died, or hangs."""
    name = action.component
    await _end_run(site, name, action.host, action.incumbent)
    incumbent = site.controls.processes.get(name)
    if incumbent is not None and incumbent.begun != action.incumbent:
        raise ControlFailed(f"{name}: run {action.incumbent} was lost as it handed over, and has been restarted")
    step = Handover(HandoverStep.PROMOTE, revision=site.revision)
    await _hand_over(site, name, successor.begun, step, _takes(site, name))
    site.state_lost.add(name)


async def give_back(site: Site, action: GiveBack) -> None:
    """Have the former run speak for the component again, whatever has become of its successor; raises ControlFailed."""
    name = action.component
    await site.refresh()
    site.touch(name)
    runs = {run.begun: run for run in _runs(site, name)}
    former = runs.pop(action.incumbent, None)
    successor = next(iter(runs.values()), None)
    if former is None:
        await _begin_again(site, action, successor)
    elif await _role(site, name, former.begun) is Role.LIVE:
        await _end_successor(site, name, action.host, successor)
        if successor is not None:
            bar = Handover(HandoverStep.RESUME, successor.begun)
            await site.controls.hand_over(name, former.begun, bar).view()
    else:
        await _wake(site, action, former, successor)


async def _wake(site: Site, action: GiveBack, former: ProcessStatus, successor: ProcessStatus | None) -> None:
    """Have a frozen run go on: from the living state of its successor if this can hand it over, else from its own."""
    name = action.component
    if successor is not None and await _is_live(site, name, successor.begun):
        anew = await _renamed(site, action, former)
        step = Handover(HandoverStep.TAKE_OVER, successor.incarnation, anew, revision=site.revision)
        try:
            await _hand_over(site, name, former.begun, step, _takes(site, name))
        except ControlFailed as error:
            site.kit.log.warning("%s: the state of now could not be handed back: %s", name, error)
        else:
            await _go_on_if_there_is_time(site, name)
            await _end_successor(site, name, action.host, successor)
            await site.refresh()
            return
    await _end_successor(site, name, action.host, successor)
    anew = await _renamed(site, action, former)
    peer = successor.begun if successor is not None else 0
    step = Handover(HandoverStep.RESUME, peer, anew, revision=site.revision)
    await _hand_over(site, name, former.begun, step, _takes(site, name))
    await _go_on_if_there_is_time(site, name)
    await site.refresh()


async def _go_on_if_there_is_time(site: Site, name: str) -> None:
    """Let simulated time go on with a run; to a source of time that is gone, it comes back by itself."""
    try:
        await go_on_in_step(site, name)
    except ControlFailed as error:
        site.kit.log.warning("%s: simulated time does not go on with it yet: %s", name, error)


async def _renamed(site: Site, action: GiveBack, former: ProcessStatus) -> int:
    """Tell the host as what a run will speak, before it does: its heartbeats are to be known."""
    name = action.component
    await _let_speak(
        site, name, action.host, former.begun, max(run.incarnation for run in (former, *_runs(site, name)))
    )
    return site.controls.processes[name].incarnation


async def _begin_again(site: Site, action: GiveBack, successor: ProcessStatus | None) -> None:
    """Start the component as it was before: the run of before has ended, as any component may at any time."""
    name = action.component
    await _end_successor(site, name, action.host, successor)
    spec = site.before.components[name]
    deadline = time.monotonic() + site.bounds.start
    while True:
        await site.refresh()
        process = site.controls.processes.get(name)
        if process is not None and process.state is ProcessState.RUNNING:
            return
        if process is None or process.state in (ProcessState.STOPPED, ProcessState.QUARANTINED):
            _note(site, name, await site.hosts.start(name, action.host, resume=False))
        if time.monotonic() > deadline:
            raise NoAnswer(f"{spec.name}: it has not come back within {site.bounds.start:g} s")
        await site.pause(LOOK_AGAIN_AFTER)


async def end_successor(site: Site, action: EndSuccessor) -> None:
    """End what stands beside a component's run; does nothing if nobody does. Raises ControlFailed."""
    await site.refresh()
    beside = _beside(site, action.component)
    if beside is not None and beside.begun != action.incumbent:
        await _end_successor(site, action.component, action.host, beside)


async def retire(site: Site, name: str, host: str, grace: float) -> None:
    """End the run beside a component, which nobody will ask to go on any more; raises ControlFailed."""
    beside = _beside(site, name)
    if beside is not None:
        await _end_run(site, name, host, beside.begun, grace)


async def _end_successor(site: Site, name: str, host: str, successor: ProcessStatus | None) -> None:
    if successor is not None:
        await _end_run(site, name, host, successor.begun)


async def _end_run(site: Site, name: str, host: str, begun: int, grace: float = WITHOUT_MERCY) -> None:
    """End one run for certain; raises ControlFailed."""
    await site.hosts.stop(name, host, grace, begun)
    deadline = time.monotonic() + grace + KILLED_WITHIN
    while True:
        await site.refresh()
        run = next((run for run in _runs(site, name) if run.begun == begun), None)
        if host not in site.hosts.silent and (run is None or run.state is ProcessState.STOPPED):
            return
        if time.monotonic() > deadline:
            raise NoAnswer(f"host {host!r}: run {begun} of {name} has not ended within {grace + KILLED_WITHIN:g} s")
        await site.pause(LOOK_AGAIN_AFTER)


# --- who there is ---


def _beside(site: Site, name: str) -> ProcessStatus | None:
    return site.controls.processes.get(f"{name}{BESIDE}")


def _runs(site: Site, name: str) -> list[ProcessStatus]:
    processes = (site.controls.processes.get(name), _beside(site, name))
    return [process for process in processes if process is not None and process.state is not ProcessState.STOPPED]


def _note(site: Site, name: str, told: dict[str, ProcessStatus]) -> None:
    """Take what a host has told of its processes, also that nobody stands beside a component any more."""
    site.controls.processes.pop(f"{name}{BESIDE}", None)
    site.controls.processes |= told


async def _let_speak(site: Site, name: str, host: str, begun: int, above: int | None = None) -> None:
    _note(site, name, await site.hosts.let_speak(name, host, begun, above))


async def _hand_over(site: Site, name: str, begun: int, step: Handover, within: float) -> ComponentView:
    return await site.controls.hand_over(name, begun, step, within).view()


def _takes(site: Site, name: str) -> float:
    """Return the seconds within which a step of a hand-over is answered."""
    specs = (site.before.components.get(name), site.after.components.get(name))
    both = [spec.description for spec in specs if spec and spec.description]
    longest = max((description.longest_handler for description in both), default=0.0)
    # One run after the other lets go and takes hold, each by its own methods.
    hooks = sum(2 * description.longest_handler for description in both if description.exclusive)
    return max(site.bounds.answer, TAKE_OVER_WITHIN) + longest + hooks


async def _role(site: Site, name: str, begun: int) -> Role:
    view = await site.controls.hand_over(name, begun, Handover(HandoverStep.READ)).view()
    return Role(view.detail.get("role"))


async def _is_there(site: Site, name: str, begun: int) -> bool:
    try:
        await _role(site, name, begun)
    except NoAnswer:
        return False
    return True


async def _is_live(site: Site, name: str, begun: int) -> bool:
    try:
        view = await _hand_over(site, name, begun, Handover(HandoverStep.READ), site.bounds.answer)
    except ControlFailed:
        return False
    return view.detail.get("role") == Role.LIVE.value and view.state in (State.ACTIVE, State.INACTIVE)
