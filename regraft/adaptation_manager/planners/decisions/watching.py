"""When a planner decides by itself: periodically, when a fault comes or goes, when a requirement turns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.question import Known
from regraft.bus_schema.model.expressions import Unknown

LOOK_EVERY: Final = 0.1
"""Seconds between two looks at faults and requirements."""
ROUNDING: Final = 1e-6
"""Seconds by which times may differ that are meant to be equal."""


class Watch:
    """Sees when it is time to decide.

    The first look only takes note of what is so. Something that is not known any more has not changed.
    """

    def __init__(self, decision: Decision, now: float) -> None:
        self._decision = decision
        self._due = None if decision.triggers.every is None else now + decision.triggers.every
        self._before: dict[str, bool] | None = None

    def pause(self, now: float) -> float:
        """Return the seconds until the next look."""
        triggers = self._decision.triggers
        looks = triggers.on_fault or triggers.on_requirement
        until_due = max(0.0, self._due - now) if self._due is not None else LOOK_EVERY
        return min(LOOK_EVERY, until_due) if looks else until_due

    def reasons(self, now: float, situation: Mapping[str, Any]) -> list[str]:
        """Return why to decide now, nothing if it is not time."""
        found = []
        period = self._decision.triggers.every
        if self._due is not None and period is not None and now >= self._due - ROUNDING:
            found.append(f"every {period:g} s")
            self._due = max(self._due + period, now)
        seen = self._truths(situation)
        before = seen if self._before is None else self._before
        found += [self._turned(name, value) for name, value in seen.items() if before.get(name, not value) != value]
        self._before = before | seen
        return found

    def _turned(self, name: str, value: bool) -> str:
        if name.startswith("fault "):
            return f"{name} {'has come' if value else 'is gone'}"
        return f"{name} is {'met' if value else 'not met'}"

    def _truths(self, situation: Mapping[str, Any]) -> dict[str, bool]:
        found = {}
        if self._decision.triggers.on_fault:
            known = Known(situation, self._decision.weights)
            for fault in self._decision.faults:
                try:
                    found[f"fault {fault.name}"] = bool(fault.when.value(known))
                except Unknown:
                    continue
        for entry in self._decision.context:
            if entry.requirement in self._decision.triggers.on_requirement and entry.name in situation:
                found[f"requirement {entry.requirement}"] = bool(situation[entry.name])
        return found
