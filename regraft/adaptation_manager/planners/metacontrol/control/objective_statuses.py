"""The status of objectives, for clients."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from regraft.adaptation_manager.planners.metacontrol.control.state import ControlState, why_left
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import required_objectives
from regraft.bus_schema.messages.management.objectives import (
    Explanation,
    ObjectivesStatus,
    ObjectiveState,
    ObjectiveStatus,
    Progress,
)


def all_statuses(state: ControlState, now: float, trouble: str = "") -> ObjectivesStatus:
    """Return the status of all objectives. ``trouble`` is what keeps the loop from deciding, empty if nothing does."""
    found: list[ObjectiveStatus] = []
    for entry in state.store:
        name = entry.given.name
        found += [replace(each, task=entry.given.task) for each in family(state, name, trouble)]
    resting = {f"{rest.objective}: {local_name(rest.design)}": rest.until for rest in state.resting.all(now)}
    monitor = state.monitor
    return ObjectivesStatus(now, monitor.context, tuple(found), monitor.contexts, resting)


def family(state: ControlState, name: str, trouble: str = "") -> Iterator[ObjectiveStatus]:
    """Yield the status of an objective, and of those that its realization requires."""
    entry = state.store[name]
    decisions = state.decided.plan.decisions if state.decided else ()
    objectives = {name: entry.objective}
    own = next((each for each in decisions if each.objective == name), None)
    yield replace(
        _status(state, entry.objective, own, trouble),
        progress=entry.progress,
        ended=entry.progress is not Progress.INPROGRESS,
        attempts=tuple(entry.attempts),
        task=entry.given.task,
    )
    for each in decisions:  # those that a design requires come after it
        if each.parent in objectives and each.objective in objectives:
            yield _status(state, objectives[each.objective], each, trouble)
        if each.design is not None and each.objective in objectives:
            required = required_objectives(objectives[each.objective], state.model.designs[each.design])
            objectives |= {one.name: one for one in required}


def _status(state: ControlState, objective: Objective, decision: Decision | None, trouble: str) -> ObjectiveStatus:
    grounded = state.groundings.of(objective.name)
    design = grounded.design if grounded else ""
    known = state.model.designs.get(design)
    status, reasons, why = _state(state, decision, design)
    is_same = decision is not None and decision.present == design
    measured = state.decided.measured.get(objective.name, {}) if state.decided and is_same else {}
    return ObjectiveStatus(
        objective.name,
        local_name(objective.function),
        ObjectiveState(status.value),
        parent=decision.parent if decision else "",
        priority=objective.priority,
        always_improve=objective.always_improve,
        requirements={local_name(each.quality): each.bound for each in objective.requirements},
        realization=local_name(design) if design else "",
        mode=state.designs.of(design).mode if state.designs and design else "",
        since=grounded.since if grounded else None,
        measured={local_name(quality): value for quality, value in measured.items()},
        expected={local_name(quality): value for quality, value in known.estimates.items()} if known else {},
        reasons=(*((trouble,) if trouble else ()), *reasons),
        why=why,
    )


def _state(state: ControlState, decision: Decision | None, design: str) -> tuple[Status, tuple[str, ...], str]:
    """Return the status, its reasons, and why there is this design."""
    if decision is None or state.decided is None:
        return Status.UNGROUNDED, ("no decision was made yet",), ""
    analysed = state.decided.analysis.objectives.get(decision.objective)
    if design and design == decision.present and analysed is not None and analysed.is_in_error:
        return analysed.status, (why_left(decision),), ""
    if decision.design is None:
        return decision.status, (decision.why,), ""
    if not design:
        return Status.UNGROUNDED, (), ""
    return Status.IN_PROGRESS, (), decision.why if design == decision.design else ""


def explanation(state: ControlState, name: str, now: float, trouble: str = "") -> Explanation:
    """Return what spoke for and against each design in the latest decision; raises RequestRefused."""
    status = next(family(state, name, trouble))
    decision = state.decided.plan.of(name) if state.decided else None
    if decision is None or state.decided is None:
        return Explanation(name, state.decided_at, "; ".join(status.reasons))
    lines = list(decision.lines())
    for reason in state.decided.analysis.why_in_error(name):
        lines += ["in error:", *(f"  {line}" for line in reason.lines())]
    updatable = state.decided.analysis.why_updatable(name)
    if updatable is not None:
        lines += ["reconsidered:", *(f"  {line}" for line in updatable.lines())]
    lines += [
        f"failed {max(0.0, now - each.stamp):.1f} s ago: {each.realization}: {each.why}" for each in status.attempts
    ]
    return Explanation(name, state.decided_at, "\n".join(lines), decision.as_data())
