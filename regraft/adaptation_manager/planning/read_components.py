"""How the components of a request really are, and what that means for it: only what is needed active has to be well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from regraft.adaptation_manager.planning.modes import meant
from regraft.adaptation_manager.steps.actions import Action, ApplyParameters, ConnectAgain, PlannedStep, StayDown
from regraft.adaptation_manager.steps.draft import Draft
from regraft.adaptation_manager.targets.component_client import ComponentClient, ControlFailed, NoAnswer, PendingQuery
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.adaptation_manager.targets.processes import NOT_RUNNING
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.adaptation import (
    AdaptationRequest,
    Change,
    Connect,
    Move,
    Remove,
    SetParameters,
    Swap,
    Unreached,
    UnreachedCode,
    Violation,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State, is_at_most, is_lower

COMING = (ProcessState.WAITING, ProcessState.STARTING)
"""States of a process that is about to run."""


@dataclass(frozen=True, slots=True)
class Silent:
    """A component that did not answer, and ``why``; ``code`` is that for programs.

    ``broken`` means that it is not about to come back by itself. ``may_act`` means that it may have a process.
    ``replaceable`` means that a swap can start another in its place. ``out_of_reach`` means that its host may run it
    and does not answer.
    """

    why: str
    broken: bool
    may_act: bool
    replaceable: bool
    out_of_reach: bool
    code: UnreachedCode


@dataclass(frozen=True, slots=True)
class Read:
    """The views of the components that answered, and those that are silent."""

    live: dict[str, ComponentView] = field(default_factory=dict)
    silent: dict[str, Silent] = field(default_factory=dict)

    def states(self) -> dict[str, State]:
        """Return the states that components are in."""
        return {name: view.state for name, view in self.live.items()}


async def read_named(
    request: AdaptationRequest, architecture: Architecture, controls: ComponentClient, hosts: Hosts
) -> Read:
    """Read every component that a request names, also those that a mode may find as it wants them.

    Where only parameters are set, nothing that a component does by itself matters: its last answer will do.
    """
    changes = meant(request.changes, architecture)
    specs = (architecture.components.get(change.component) for change in changes)
    names = list(dict.fromkeys(spec.name for spec in specs if spec is not None and spec.managed))
    if not request.dry_run and all(isinstance(change, SetParameters) for change in changes):
        last = [controls.last_answer(name, architecture.components[name].host) for name in names]
        if all(last):
            return Read({view.component: view for view in last if view})
    return await read_components(names, architecture, controls, hosts)


async def read_components(
    names: Sequence[str], architecture: Architecture, controls: ComponentClient, hosts: Hosts
) -> Read:
    """Read components of these names."""
    # Components are asked where they ran last while hosts report where they run now: few have been restarted.
    guessed: dict[str, PendingQuery] = {name: controls.read(name) for name in names}
    controls.processes = await hosts.processes(architecture.revision)
    asked = {n: one if controls.is_living(one) else controls.read(n) for n, one in guessed.items()}
    read = Read()
    for name in names:
        try:
            read.live[name] = await asked[name].view()
        except ControlFailed as error:
            read.silent[name] = _silent(name, architecture.components[name].host, error, controls, hosts)
    return read


def _silent(name: str, host: str, error: ControlFailed, controls: ComponentClient, hosts: Hosts) -> Silent:
    process = controls.processes.get(name)
    if host in hosts.silent:
        code = hosts.how_not_there(host)
        # A host that has not joined runs nothing, as certainly as one that is lost.
        gone = host in hosts.lost or code is UnreachedCode.HOST_ABSENT
        return Silent(f"its {hosts.why_not_there(host)}", gone, False, False, not gone, code)
    replaceable = process is not None and _is_broken(process, error)
    hangs = isinstance(error, NoAnswer) and not error.gone
    may_act = process is not None and process.state not in NOT_RUNNING
    why = _why_silent(controls, name, error)
    code = UnreachedCode.NO_ANSWER if may_act else UnreachedCode.NOT_RUNNING
    return Silent(why, process is None or replaceable or hangs, may_act, replaceable, False, code)


def _is_broken(process: ProcessStatus, error: ControlFailed) -> bool:
    """Return whether a component that did not answer does not run, or will have ended again in a moment."""
    gone = isinstance(error, NoAnswer) and error.gone
    return process.state in NOT_RUNNING or (keeps_ending(process) and (gone or process.state in COMING))


def keeps_ending(process: ProcessStatus) -> bool:
    """Return whether a component that should run was restarted before."""
    return process.restarts > 0 and process.state not in NOT_RUNNING


def _why_silent(controls: ComponentClient, name: str, error: ControlFailed) -> str:
    process = controls.processes.get(name)
    if process is None:
        return "is not running: no host has a process for it"
    if process.state is ProcessState.QUARANTINED:
        return f"is quarantined after {process.restarts} restarts: start or swap it first ({process.exit_reason})"
    if controls.living(name) is None:
        return f"is not running: its process is {process.state.value} ({process.exit_reason or 'never started'})"
    return str(error)


def needed_but_silent(draft: Draft, read: Read, request: AdaptationRequest) -> list[Violation]:
    """Return the components that do not answer, and without which the changes cannot be."""
    first_use: dict[str, int] = {}
    for index, change in enumerate(request.changes):
        first_use.setdefault(change.component, index)
    return [
        Violation(index, name, "status", read.silent[name].why)
        for name, index in first_use.items()
        if name in read.silent and _is_needed(name, read.silent[name], draft, request.changes)
    ]


def _is_needed(name: str, silent: Silent, draft: Draft, changes: Sequence[Change]) -> bool:
    kinds = {type(change) for change in changes if change.component == name}
    spec = draft.before[name]
    if Remove in kinds or (Move in kinds and spec.host in draft.lost):
        return False  # what does not answer, or is not there, can go as it is, and start elsewhere
    if Move in kinds or (Swap in kinds and not silent.replaceable):
        return True
    if Swap in kinds:
        return False  # what is broken can be replaced
    if silent.out_of_reach:
        return True
    return draft.spec(name).state is State.ACTIVE and not _only_disconnects(name, changes)


def _only_disconnects(name: str, changes: Sequence[Change]) -> bool:
    """Return whether a component is only to be connected to less: it need not run for that."""
    return all(isinstance(c, Connect) and c.topic is None for c in changes if c.component == name)


def not_reached(request: AdaptationRequest, architecture: Architecture, read: Read) -> tuple[Unreached, ...]:
    """Return the components that a request is about and that do not answer, but for those that it replaces."""
    replaced = {c.component for c in meant(request.changes, architecture) if isinstance(c, Remove | Swap | Move)}
    return tuple(
        Unreached(name, silent.code, architecture.components[name].host, silent.why)
        for name, silent in sorted(read.silent.items())
        if name not in replaced
    )


def kept_down(draft: Draft, read: Read, request: AdaptationRequest) -> list[PlannedStep]:
    """Return the steps that end what may still act of components that do not answer, and are not needed."""
    left = {change.component for change in request.changes if isinstance(change, Remove | Swap | Move)}
    steps = []
    for name in dict.fromkeys(change.component for change in request.changes):
        silent = read.silent.get(name)
        if silent is None or not silent.may_act or name in left or name not in draft.architecture.components:
            continue
        spec = draft.spec(name)
        # An undo does not bring back what had failed before.
        back: Action = ApplyParameters(name, {})
        active = spec.state is State.ACTIVE
        if active:
            before = draft.before[name].connections
            left_ports = [c.port for c in request.changes if isinstance(c, Connect) and c.component == name]
            back = ConnectAgain(name, {port: before[port] for port in left_ports if port in before})
        text = "start it again as it is to be" if active else f"keep {spec.state.value}"
        text = f"{text} although it does not answer"
        steps.append(PlannedStep(name, text, StayDown(name, spec.host, spec.state), back))
    return steps


def as_it_is(before: Architecture, after: Architecture, read: Read) -> Architecture:
    """Return the architecture before, but without what has failed and is not to be active afterwards.

    Others miss already what a failed component would give: that is not held against the changes.
    """
    found = before
    for name, spec in before.components.items():
        silent, live = read.silent.get(name), read.live.get(name)
        failed = silent.broken if silent else live is not None and is_lower(live.state, spec.state)
        following = after.components.get(name)
        if failed and following is None:
            found = found.without({name})
        elif failed and following is not None and is_at_most(following.state, State.INACTIVE):
            found = found.with_component(replace(spec, state=following.state))
    return found
