"""When a planner decides by itself: periodically, when a fault comes or goes, when a requirement turns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from regraft import Future, Kit
from regraft.adaptation_manager.planners.decisions.model import ContextEntry, Decision
from regraft.adaptation_manager.planners.decisions.question import Known
from regraft.adaptation_manager.planners.decisions.situation import system_input
from regraft.bus_schema.model.expressions import Unknown

LOOK_EVERY: Final = 0.1
"""Seconds between two looks at the topics on which faults depend."""
RETRY_AFTER: Final = 1.0
"""Seconds after which a decision is tried again that could not be taken."""
FAULT: Final = "fault "
"""The begin of what a fault is called as a reason."""
ROUNDING: Final = 1e-6
"""Seconds by which times may differ that are meant to be equal."""


class Watch:
    """Sees when it is time to decide.

    Until something is known, no fault is there and each requirement is met. Something that is not known any more has
    not changed. A fault or requirement that has turned stays a reason until the decision is taken, or it turns back.
    """

    def __init__(self, decision: Decision, now: float) -> None:
        self._decision = decision
        self._due = None if decision.triggers.every is None else now + decision.triggers.every
        self._before: dict[str, bool] = {}
        self._undecided: dict[str, bool] = {}
        self._again: float | None = None
        entries = tuple(_entries_watched(decision))
        self._waking = sorted({name for entry in entries if (name := system_input(entry))})
        self._looks = any(entry.topic for entry in entries)

    async def pause(self, kit: Kit) -> None:
        """Wait until the next look is due, or a message of the system itself may be a reason."""
        waits: list[Future[Any]] = [kit.inputs[name].next() for name in self._waking if name in kit.inputs]
        pauses = [LOOK_EVERY] if self._looks else []
        pauses += [max(0.0, due - kit.now()) for due in (self._due, self._again) if due is not None]
        waits += [kit.sleep(min(pauses))] if pauses else []
        over: Future[None] = Future()
        for each in waits:
            each.when_done(lambda: over.resolve(None))
        try:
            await over
        finally:
            for each in waits:
                each.abandon()

    def reasons(self, now: float, situation: Mapping[str, Any]) -> list[str]:
        """Return why to decide now, nothing if it is not time."""
        periodic = []
        period = self._decision.triggers.every
        if self._due is not None and period is not None and now >= self._due - ROUNDING:
            periodic.append(f"every {period:g} s")
            self._due = max(self._due + period, now)
        seen = self._truths(situation)
        before = {name: not name.startswith(FAULT) for name in seen} | self._before
        turned = {name: value for name, value in seen.items() if before[name] != value}
        self._before |= seen
        self._undecided |= turned
        if not (periodic or turned or (self._again is not None and now >= self._again - ROUNDING)):
            return []
        return periodic + [self._turned(name, value) for name, value in self._undecided.items()]

    def decided(self, now: float, *, taken: bool) -> None:
        """Take note whether the decision was taken for the reasons that were returned last."""
        if taken:
            self._undecided.clear()
        self._again = now + RETRY_AFTER if self._undecided else None

    def _turned(self, name: str, value: bool) -> str:
        if name.startswith(FAULT):
            return f"{name} {'has come' if value else 'is gone'}"
        return f"{name} is {'met' if value else 'not met'}"

    def _truths(self, situation: Mapping[str, Any]) -> dict[str, bool]:
        found = {}
        if self._decision.triggers.on_fault:
            known = Known(situation, self._decision.weights)
            for fault in self._decision.faults:
                try:
                    found[f"{FAULT}{fault.name}"] = bool(fault.when.value(known))
                except Unknown:
                    continue
        for entry in self._decision.context:
            if entry.requirement in self._decision.triggers.on_requirement and entry.name in situation:
                found[f"requirement {entry.requirement}"] = bool(situation[entry.name])
        return found


def _entries_watched(decision: Decision) -> Iterator[ContextEntry]:
    """Yield the entries that the triggers of a decision depend on."""
    names = {name for fault in decision.faults for name in fault.when.names} if decision.triggers.on_fault else set()
    unfolded: set[str] = set()
    while new := names & decision.weights.keys() - unfolded:
        unfolded |= new
        names |= {name for weight in new for name in decision.weights[weight].names}
    for entry in decision.context:
        if entry.name in names or (entry.requirement and entry.requirement in decision.triggers.on_requirement):
            yield entry
