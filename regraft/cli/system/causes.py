"""Why a run is not repeatable, or had to restart parts: the clock's causes, and the ends that hosts report."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.clock import CauseCode, RunCause

NOT_RESTARTED: Final = "component.ended"
ENDS: Final = {
    "component.hung": CauseCode.HUNG,
    "component.over_limit": CauseCode.OVER_LIMIT,
    "component.restarted": CauseCode.ENDED,
    "component.quarantined": CauseCode.ENDED,
    NOT_RESTARTED: CauseCode.ENDED,
}
"""The events of a host by which a run of a component ends, and the cause that each is."""
FOLLOWS: Final = (CauseCode.LEFT, CauseCode.REPLACED, CauseCode.SOURCE_RESTARTED)
"""Causes of the clock that are explained by what a host reports of the same component."""


class CauseLog:
    """Collects the ends of components that no schedule wants, as hosts report them by events."""

    def __init__(self) -> None:
        self._ends: dict[str, RunCause] = {}
        self._well: set[str] = set()

    def take(self, event: Event) -> None:
        """Take an event, if it is of an end. The first of a component counts: the restart follows from it."""
        code = ENDS.get(event.kind)
        if code is None or event.details.get("scheduled"):
            return
        if event.kind == NOT_RESTARTED:
            self._well.add(event.subject)
        self._ends.setdefault(event.subject, RunCause(code, event.subject, event.stamp, event.text))

    def with_clock(self, causes: Iterable[RunCause]) -> tuple[RunCause, ...]:
        """Return all causes, in the order of their times; for an end, the host's account replaces the clock's.

        A component that ended and need not be restarted is a cause only where the clock missed it.
        """
        of_clock = list(causes)
        missed = {cause.component for cause in of_clock}
        ends = [end for name, end in self._ends.items() if name in missed or name not in self._well]
        others = [cause for cause in of_clock if cause.code not in FOLLOWS or cause.component not in self._ends]
        return tuple(sorted([*others, *ends], key=lambda cause: cause.stamp))
