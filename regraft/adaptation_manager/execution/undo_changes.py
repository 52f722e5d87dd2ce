"""Undoing an applied adaptation: the changes that lead back, and what prevents them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from regraft.adaptation_manager.journal.revisions import architectures_around
from regraft.adaptation_manager.planning.modes import meant, unfolded
from regraft.bus_schema.model.adaptation import (
    APPLIED,
    AdaptationReport,
    AdaptationRequest,
    Add,
    Change,
    ChangeState,
    Connect,
    Move,
    Remove,
    SetParameters,
    Swap,
    Violation,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import DOWNWARD, State, after, route
from regraft.bus_schema.model.wiring import own_topic

if TYPE_CHECKING:
    from regraft.adaptation_manager.journal.journal import Journal

MAX_LATER = 1000
"""Later adaptations that an undo is compared with: to read more keeps the manager busy for too long."""
MAX_NAMED = 10
"""Of these, how many a problem names."""

PRESENCE = "component"
"""The field of a component for whether it is there."""
THERE = "there"
"""The value of that field for one that is."""
HOST = "host"
"""The field of a component that a move decides on."""
CLASS = "class"
"""The field of a component that a swap decides on, with all that its class has."""


def undo_of(
    undone: AdaptationReport, request: AdaptationRequest, journal: Journal, now: Architecture
) -> tuple[AdaptationRequest, tuple[Violation, ...]]:
    """Return the request that undoes an ended adaptation, and what prevents it; raises JournalError."""
    if undone.outcome not in APPLIED:
        problem = f"adaptation {undone.id} is {undone.outcome.value}: only an applied one can be undone"
        return request, (Violation(None, "", "undoes", problem),)
    before, behind = architectures_around(journal, undone)
    if before is None or behind is None:
        problem = f"what was before adaptation {undone.id} cannot be read any more: the journal was damaged"
        return request, (Violation(None, "", "undoes", problem),)
    undone = unfolded(undone, before)
    complete = replace(request, changes=inverse(undone.request.changes, before))
    if not complete.changes:
        problem = f"adaptation {undone.id} changed nothing: there is nothing to undo"
        return complete, (Violation(None, "", "undoes", problem),)
    # A later mode counts by all that it names: of its transitions, those that were needed depend on what was then.
    later = [
        replace(line, request=replace(line.request, changes=tuple(meant(line.request.changes, before))))
        for line in journal.applied_after(int(undone.id), MAX_LATER)
    ]
    found = conflicts(undone, behind, now, later)
    undo = _standing_undo(undone.id, later) if found else None
    if undo is not None:
        problem = f"adaptation {undone.id} is undone already, by adaptation {undo}; undo {undo} to have it again"
        found = [Violation(None, "", "undoes", problem)]
    return complete, tuple(found)


def _standing_undo(adaptation: str, later: Sequence[AdaptationReport]) -> str | None:
    """Return the adaptation that has undone another and is not undone itself; ``later`` are applied, newest first."""
    undone: set[str] = set()
    for line in later:
        if line.request.undoes == adaptation and line.id not in undone:
            return line.id
        undone.add(line.request.undoes)
    return None


def asked_again(undone: str, journal: Journal, now: Architecture) -> dict[str, str]:
    """Return the modes that are asked for once an adaptation is undone: what was before, where nothing is later."""
    report = journal.report(int(undone))
    before, behind = architectures_around(journal, report) if report else (None, None)
    if before is None or behind is None:
        return now.asked_modes
    given = {part for part, mode in behind.asked_modes.items() if before.asked_modes.get(part) != mode}
    back = {part for part in given if now.asked_modes.get(part) == behind.asked_modes[part]}
    kept = {part: mode for part, mode in now.asked_modes.items() if part not in back}
    return kept | {part: before.asked_modes[part] for part in back if part in before.asked_modes}


def inverse(changes: Sequence[Change], before: Architecture) -> tuple[Change, ...]:
    """Return the changes that lead from behind ``changes`` back to the architecture ``before`` them."""
    states: dict[str, State] = {}
    back: list[tuple[Change, ...]] = []
    known = set(before.topics)
    come_or_gone = {change.component for change in changes if isinstance(change, Add | Remove)}
    swapped = {change.component for change in changes if isinstance(change, Swap)}
    for change in changes:
        if isinstance(change, Add):
            new = tuple(topic.name for topic in change.topics if topic.name not in known)
            known.update(new)  # the last removal takes out what several additions name
            back.append((Remove(change.component, new),))
        elif isinstance(change, Remove):
            topics = tuple(before.topics[name] for name in change.topics if name in before.topics)
            back.append((Add(change.component, before.components[change.component], topics, resume=True),))
        if change.component in come_or_gone:
            continue  # it comes back, or goes, as a whole
        spec = before.components[change.component]
        if isinstance(change, Swap):
            back.append((_swap_back(spec, with_state=change.with_state),))
        elif isinstance(change, Move):
            back.append((Move(spec.name, spec.host, change.with_state),))
        elif isinstance(change, SetParameters | Connect) and change.component in swapped:
            continue  # the swap back gives all values and connections
        elif isinstance(change, SetParameters):
            values = {name: _parameter(spec, name) for name in change.parameters}
            back.append((SetParameters(spec.name, values),))
        elif isinstance(change, Connect):
            back.append((Connect(spec.name, change.port, _topic(before, spec, change.port)),))
        elif isinstance(change, ChangeState):
            start = states.get(spec.name, spec.state)
            end = after(start, change.transition) or DOWNWARD.get(change.transition, start)
            states[spec.name] = end
            back.append(tuple(ChangeState(spec.name, transition) for transition in route(end, start) or ()))
    return tuple(change for changes_back in reversed(back) for change in changes_back)


def _swap_back(spec: ComponentSpec, *, with_state: bool) -> Swap:
    """Return the swap that leads back to a spec, with all its fields: what is left out would be kept."""
    parameters = spec.description.parameters if spec.description else ()
    values = {parameter.name: _parameter(spec, parameter.name) for parameter in parameters}
    return Swap(spec.name, spec.cls, values, dict(spec.connections), dict(spec.services), with_state)


def touched(changes: Sequence[Change]) -> set[tuple[str, str]]:
    """Return the (component, field) pairs that ``changes`` decide on."""
    pairs: set[tuple[str, str]] = set()
    for change in changes:
        if isinstance(change, SetParameters):
            pairs |= {(change.component, f"parameters.{name}") for name in change.parameters}
        elif isinstance(change, Connect):
            pairs.add((change.component, f"connect.{change.port}"))
        elif isinstance(change, Add | Remove):
            pairs.add((change.component, PRESENCE))
        elif isinstance(change, Swap):
            pairs.add((change.component, CLASS))
            pairs |= {(change.component, f"parameters.{name}") for name in change.parameters}
            pairs |= {(change.component, f"connect.{port}") for port in change.connections}
            pairs |= {(change.component, f"services.{name}") for name in change.services}
        elif isinstance(change, Move):
            pairs.add((change.component, HOST))
        else:
            pairs.add((change.component, "state"))
    return pairs


def conflicts(
    report: AdaptationReport, behind: Architecture, now: Architecture, later: Sequence[AdaptationReport]
) -> list[Violation]:
    """Return what later adaptations decided otherwise, naming each.

    A value that is still, or again, as it was given is no conflict.

    ``behind`` is the architecture that the adaptation to be undone gave, ``now`` the current one. ``later`` are the
    newest ones, newest first, at most ``MAX_LATER``.
    """
    found = []
    decided = touched(report.request.changes)
    decided_later = [(other.id, touched(other.request.changes)) for other in later]
    come_or_gone = {component for component, where in decided if where == PRESENCE}
    for component, where in sorted(decided):
        if where == CLASS:
            decided = decided | _all_of(behind.components[component])
    for component, where in sorted(decided):
        if where != PRESENCE and component in come_or_gone:
            continue
        fields = {(component, what) for what in (where, PRESENCE, CLASS)}
        others = [other for other, pairs in decided_later if pairs & fields]
        given, current = _value(behind, component, where), _value(now, component, where)
        replaced = len(later) >= MAX_LATER or any((component, PRESENCE) in pairs for _, pairs in decided_later)
        if where == PRESENCE and given == current == THERE and replaced:
            given, current = _which(behind, component), _which(now, component)
        if given == current:
            continue
        problem = (
            f"was changed again by {_named(others, later)}: it is {current!r}, "
            f"adaptation {report.id} gave {given!r}; undo the later one first"
        )
        found.append(Violation(None, component, where, problem))
    return found


def _named(others: Sequence[str], later: Sequence[AdaptationReport]) -> str:
    """Return in words which of the ``later`` adaptations, newest first, decided otherwise."""
    if others:
        more = f" and {len(others) - MAX_NAMED} more" if len(others) > MAX_NAMED else ""
        return f"adaptation {', '.join(others[:MAX_NAMED])}{more}"
    return (
        f"an adaptation before the last {MAX_LATER}"
        if len(later) >= MAX_LATER
        else "an adaptation whose line is damaged"
    )


def _which(architecture: Architecture, component: str) -> str:
    """Return which component it is that is there: one that was added under a name in use before may be another."""
    spec = architecture.components[component]
    return f"{spec.cls or ' '.join(spec.command)} on {spec.host}"


def _all_of(spec: ComponentSpec) -> set[tuple[str, str]]:
    """Return all that a swap back decides on."""
    fields = {f"connect.{port}" for port in spec.connections} | {f"services.{name}" for name in spec.services}
    if spec.description:
        fields |= {f"parameters.{parameter.name}" for parameter in spec.description.parameters}
    return {(spec.name, where) for where in fields}


def _value(architecture: Architecture, component: str, where: str) -> object:
    spec = architecture.components.get(component)
    if spec is None:
        return "removed"
    if where == PRESENCE:
        return THERE
    if where == CLASS:
        return spec.cls
    if where == HOST:
        return spec.host
    kind, _, name = where.partition(".")
    if kind == "parameters":
        return _parameter(spec, name)
    if kind == "services":
        return spec.services.get(name)
    return _topic(architecture, spec, name) if kind == "connect" else spec.state.value


def _parameter(spec: ComponentSpec, name: str) -> object:
    described = spec.description.parameter(name) if spec.description else None
    return spec.parameters.get(name, described.default if described else None)


def _topic(architecture: Architecture, spec: ComponentSpec, port: str) -> str | None:
    """Return the topic of a port, None if it has none: one that is left out has its own, if there is such a topic."""
    described = spec.description.port(port) if spec.description else None
    own = own_topic(spec, described, architecture.scopes) if described else ""
    return spec.connections.get(port, own if own in architecture.topics else None)
