"""The phases of an adaptation: how long each took, published as it ends."""

from __future__ import annotations

import time
from collections.abc import Callable

from regraft.bus_schema.model.adaptation import Phase, PhaseReport


class Phases:
    """Times the phases of one adaptation, by the wall clock."""

    def __init__(self) -> None:
        self.ended: list[PhaseReport] = []
        self._phase: Phase | None = None
        self._since = 0.0
        self._tell: Callable[[PhaseReport], object] | None = None

    def speak(self, tell: Callable[[PhaseReport], object]) -> None:
        """Report the phases that have ended, and of the others as they do."""
        self._tell = tell
        for phase in self.ended:
            tell(phase)

    def enter(self, phase: Phase) -> None:
        """End the phase that there was, and begin one; to be in it already changes nothing."""
        if phase is not self._phase:
            self.leave()
            self._phase, self._since = phase, time.monotonic()

    def leave(self, lasted: float | None = None) -> None:
        """End the phase that there is, if any; it has ``lasted`` so many seconds if that is known better."""
        if self._phase is None:
            return
        phase = PhaseReport(self._phase, time.monotonic() - self._since if lasted is None else lasted)
        self._phase = None
        self.ended.append(phase)
        if self._tell is not None:
            self._tell(phase)
