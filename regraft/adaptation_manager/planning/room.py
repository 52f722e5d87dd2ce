"""Checks that hosts have room for what runs only while an adaptation is carried out.

A successor and its incumbent both need room, because the incumbent may have to continue: their ``memory`` and their
named amounts add up, on the hosts where they are. ``cpu`` counts once, since only one of the two acts. An exclusive
class releases its named amounts before its successor takes its own. A removed component keeps what it has until
the adaptation is applied.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.model.adaptation import Add, Change, Move, Remove, Swap, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.hosts.capability import UNITS, Needs, loads, measured_in, needs

Run = tuple[str, str, Needs]
"""A run: what it is called, its host, and what it needs."""


def room_violations(draft: Draft, before: Architecture, stages: Sequence[Architecture]) -> Iterator[Violation]:
    """Yield what hosts lack while a plan is carried out, each amount of a host once.

    ``stages`` are the architectures after each change. `capability_violations` finds a lack before and in the end.
    """
    if not any(isinstance(change, Add | Remove | Swap | Move) for change in draft.changes):
        return
    known = {(host, amount) for architecture in (before, stages[-1]) for host, amount, _, _ in _excess(architecture)}
    for done, architecture in enumerate((before, *stages)):
        for host, amount, limit, total in _excess(architecture, tuple(_beside(draft, done))):
            if (host, amount) in known:
                continue
            known.add((host, amount))
            index, name = _culprit(draft, done, host)
            problem = (
                f"needs room for a while: host {host!r} offers {limit:g} {measured_in(amount)}, but needs {total:g} "
                "until what is replaced or removed has ended: make room first, or remove and add in two adaptations"
            )
            field = f"resources.{amount}" if amount in UNITS else f"resources.amounts.{amount}"
            yield Violation(index, name, field, problem)


def _excess(architecture: Architecture, beside: Sequence[Run] = ()) -> Iterator[tuple[str, str, float, float]]:
    runs = [(name, spec.host, needs(spec)) for name, spec in sorted(architecture.components.items())]
    for host, load in sorted(loads((*runs, *beside)).items()):
        for amount, limit, total in load.excess(architecture.rules(host)):
            yield host, amount, limit, total


def _beside(draft: Draft, done: int) -> Iterator[Run]:
    """Yield the runs that are there besides those of the architecture after so many changes."""
    for index, change in enumerate(draft.changes):
        name = change.component
        old, new = draft.before.get(name), draft.architecture.components.get(name)
        if isinstance(change, Add) and new is not None and name in draft.added and index >= done:
            yield f"{name} (to be added)", new.host, needs(new)
        elif isinstance(change, Remove) and old is not None and name in draft.removed and index < done:
            yield f"{name} (to be removed)", old.host, needs(old)
        elif old is not None and new is not None and _is_handed_over(draft, change, index):
            yield _standby(old, new) if index < done else _standby(new, old)


def _is_handed_over(draft: Draft, change: Change, index: int) -> bool:
    """Return whether a change hands a living component over; a swap does that for a move of the same component."""
    name = change.component
    if draft.at_first(name) is None or name not in draft.swapped | draft.moved:
        return False
    if isinstance(change, Swap):
        return True
    swapped = any(isinstance(other, Swap) and other.component == name for other in draft.changes)
    return isinstance(change, Move) and not swapped and draft.before[name].host != draft.spec(name).host


def _standby(spec: ComponentSpec, acting: ComponentSpec) -> Run:
    """Return the run that waits or is frozen, while another acts."""
    exclusive = spec.description is not None and spec.description.exclusive
    kept = {amount: need for amount, need in needs(spec).items() if amount == "memory" or amount not in UNITS}
    if exclusive:
        kept = {amount: need for amount, need in kept.items() if amount in UNITS}
    return f"{spec.name} (beside {acting.cls})", spec.host, kept


def _culprit(draft: Draft, done: int, host: str) -> tuple[int | None, str]:
    """Return the change that likely brings a host to its limit: the last one done, or the first that starts there."""
    if done:
        return done - 1, draft.changes[done - 1].component
    for index, change in enumerate(draft.changes):
        new = draft.architecture.components.get(change.component)
        if isinstance(change, Add | Swap | Move) and new is not None and new.host == host:
            return index, change.component
    return None, ""
