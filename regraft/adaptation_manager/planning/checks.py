"""Phase 1: everything that is wrong with a request, found before anything moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from regraft.adaptation_manager.planning.additions import described_additions
from regraft.adaptation_manager.planning.modes import expanded
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.planning.read_components import (
    Read,
    as_it_is,
    keeps_ending,
    kept_down,
    needed_but_silent,
    not_reached,
    read_named,
)
from regraft.adaptation_manager.planning.room import room_violations
from regraft.adaptation_manager.steps import OF_PROCESSES, PLANNERS
from regraft.adaptation_manager.steps.draft import Draft
from regraft.adaptation_manager.targets.component_client import ComponentClient
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.model.adaptation import (
    AdaptationRequest,
    Add,
    Change,
    Connect,
    EnterMode,
    Move,
    Remove,
    SetParameters,
    Swap,
    Violation,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.consistency import contradictions, value_violations, violations
from regraft.bus_schema.model.modes.mode_parts import asked_after
from regraft.bus_schema.model.watch_checks import watch_violations
from regraft.bus_schema.suggestions import instead_of


async def check(
    request: AdaptationRequest, architecture: Architecture, controls: ComponentClient, hosts: Hosts, manager: str
) -> tuple[tuple[Violation, ...], Plan]:
    """Judge all changes together against the architecture and the living components, which are only read.

    Returns every violation, and the plan, to be used only if there is none. Raises ControlFailed if a host refuses to
    list what it runs.
    """
    controls.processes |= await hosts.met(architecture, {*_hosts_named(request)})
    rules, architecture = architecture.host_rules, hosts.with_joined(architecture)
    read = await read_named(request, architecture, controls, hosts)
    unreached = not_reached(request, architecture, read)
    entered = [change.mode for change in request.changes if isinstance(change, EnterMode)]
    changes, wrong = expanded(request.changes, architecture, read.states())
    found = [*_of_request(request, architecture), *wrong]
    meant = tuple(change for _, change in changes)
    request = request if meant == request.changes else replace(request, changes=meant)
    of_changes, plan = await _check_changes(request, architecture, controls, hosts, manager, read)
    found += [one if one.change is None else replace(one, change=changes[one.change][0]) for one in of_changes]
    found += watch_violations(request.watch, request.confirm, plan.after.components)
    plan = replace(plan, unreached=unreached)
    plan = plan.with_host_rules(rules)  # hosts repeat their own offers each time they join
    return tuple(found), plan.asking(asked_after(architecture.asked_modes, entered, architecture.mode_parts))


async def _check_changes(
    request: AdaptationRequest,
    architecture: Architecture,
    controls: ComponentClient,
    hosts: Hosts,
    manager: str,
    read: Read,
) -> tuple[list[Violation], Plan]:
    found = contradictions(request.changes)
    described, unclear = await described_additions(request, architecture, hosts)
    started_as = {name: process.started_as for name, process in controls.processes.items()}
    draft = Draft(
        architecture,
        {name: read.live[name] for name in {change.component for change in request.changes} & read.live.keys()},
        manager,
        described,
        started_as=started_as,
        lost=hosts.lost,
        absent=hosts.absent(),
        restarting=frozenset(n for n, p in controls.processes.items() if n not in read.live and keeps_ending(p)),
        changes=request.changes,
    )
    stages = []
    for index, change in enumerate(request.changes):
        draft.index = index
        _plan(draft, change)
        stages.append(draft.architecture)
    found += room_violations(draft, architecture, stages)
    found += [*needed_but_silent(draft, read, request), *unclear, *draft.violations]
    draft.steps[:0] = kept_down(draft, read, request)
    of_result = _of_result(request, as_it_is(architecture, draft.architecture, read), draft.architecture)
    # A part that cannot be judged might feed others: most findings on connections would be wrong.
    found += [one for one in of_result if not draft.unclear or not one.field.startswith(("connect.", "constraints."))]
    after = replace(draft.architecture, revision=architecture.revision + 1)
    # The value of a swapped component from before its swap may be wrong then, and still wrong in the result.
    found = list(dict.fromkeys(found))
    return found, Plan(architecture, after, (*draft.preparing, *draft.steps), len(draft.preparing))


def _plan(draft: Draft, change: Change) -> None:
    """Have a change planned that concerns a component which is there by then."""
    spec = draft.architecture.components.get(change.component)
    if spec is None and change.change != "add":
        hint = instead_of(change.component, draft.architecture.components)
        if change.component in draft.removed:
            draft.refuse(change.component, "component", "is removed earlier in the same request")
        elif change.component not in draft.unclear:
            draft.refuse(change.component, "component", f"there is no component of this name; {hint}")
    elif spec is not None and not spec.managed and change.change not in OF_PROCESSES:
        draft.refuse(change.component, "component", "is unmanaged: it does not speak the lifecycle")
    else:
        PLANNERS[change.change](draft, change)


def stale_revision(request: AdaptationRequest, architecture: Architecture) -> list[Violation]:
    """Return the violation of a request that was decided for an earlier revision, if it was."""
    if request.revision in (None, architecture.revision):
        return []
    problem = f"revision {request.revision} is stale: the architecture is at revision {architecture.revision}"
    return [Violation(None, "", "revision", problem)]


def _of_request(request: AdaptationRequest, architecture: Architecture) -> list[Violation]:
    found = stale_revision(request, architecture)
    if not request.changes:
        found.append(Violation(None, "", "changes", "is empty: an adaptation needs at least one change"))
    return found


def _hosts_named(request: AdaptationRequest) -> list[str]:
    """Return the hosts that changes name: one may have joined that nobody has heard of yet."""
    added = [change.spec.host for change in request.changes if isinstance(change, Add)]
    return added + [change.host for change in request.changes if isinstance(change, Move)]


def _of_result(request: AdaptationRequest, before: Architecture, after: Architecture) -> list[Violation]:
    """Return what the changes would break; what is broken already is not held against them."""
    judge = violations
    if all(isinstance(change, SetParameters) for change in request.changes):
        judge = partial(value_violations, components={c.component for c in request.changes} & after.components.keys())
    broken = judge(after)
    already = {(v.component, v.field, v.problem) for v in judge(before)} if broken else set()
    return [
        replace(violation, change=_culprit(request.changes, violation))
        for violation in broken
        if (violation.component, violation.field, violation.problem) not in already
    ]


def _culprit(changes: Sequence[Change], violation: Violation) -> int | None:
    """Return the change that a violation likely comes from: of its field, its component, or who comes or goes."""
    kind, _, name = violation.field.partition(".")
    same = [index for index, change in enumerate(changes) if change.component == violation.component]
    for index in same:
        change = changes[index]
        if isinstance(change, SetParameters | Swap) and kind == "parameters" and name in change.parameters:
            return index
        if isinstance(change, Swap) and kind in ("parameters", "connect", "services"):
            return index
        if isinstance(change, Connect) and kind == "connect" and name == change.port:
            return index
    if same:
        return same[-1]
    elsewhere = [index for index, change in enumerate(changes) if isinstance(change, Add | Remove | Move)]
    return elsewhere[0] if len(elsewhere) == 1 else None
