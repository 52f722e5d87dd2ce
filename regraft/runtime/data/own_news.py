"""The news of a member of simulated time about itself, until its next acknowledgement."""

from __future__ import annotations

from collections.abc import Container

from regraft.bus_schema.messages.health import ComponentStatus, Diagnostic
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import ComponentState, SystemFault, SystemFaultKind, SystemNews
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.system_topics import DIAGNOSTICS, MEASUREMENTS, QUALITIES

MAX_FAULTS = 100
"""Faults in one acknowledgement beyond which no exceptions are noted: those of a handler that always raises."""
MAX_KEPT = 1000
"""Subjects, and requirements, of which the latest is kept for a reader that comes later."""


class OwnNews:
    """The news of one component."""

    def __init__(self) -> None:
        self._state: ComponentState | None = None
        self._faults: list[SystemFault] = []
        self._diagnostics: dict[str, Diagnostic] = {}
        self._qualities: dict[str, Quality] = {}
        self._new_diagnostics: list[Diagnostic] = []
        self._new_qualities: dict[str, Quality] = {}
        self._measured: MeasuredQualities | None = None
        self._new_measured: MeasuredQualities | None = None
        self._wanted: Container[str] = ()
        self._seen: ComponentStatus | None = None

    def forget(self) -> None:
        """Take nothing for known: the next receiver may know nothing of this run."""
        self._state = self._seen = None
        self._wanted = ()

    def fault(self, status: ComponentStatus, stamp: float, kind: SystemFaultKind, text: str, code: str = "") -> None:
        """Note a fault, or that one is over."""
        if kind is not SystemFaultKind.RAISED or len(self._faults) < MAX_FAULTS:
            self._faults.append(SystemFault(stamp, status.component, status.incarnation, kind, text, code))

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Note a diagnostic."""
        if diagnostic.subject in self._diagnostics or len(self._diagnostics) < MAX_KEPT:
            self._diagnostics[diagnostic.subject] = diagnostic
            if DIAGNOSTICS in self._wanted:
                self._new_diagnostics.append(diagnostic)

    def quality(self, quality: Quality) -> None:
        """Note how a requirement is met."""
        if quality.requirement in self._qualities or len(self._qualities) < MAX_KEPT:
            self._qualities[quality.requirement] = quality
            if QUALITIES in self._wanted:
                self._new_qualities[quality.requirement] = quality

    def measured(self, measured: MeasuredQualities | None) -> None:
        """Note what the component measures of itself, None: nothing since it became active."""
        self._measured = measured
        self._new_measured = measured if MEASUREMENTS in self._wanted else None

    def want(self, topics: Container[str]) -> None:
        """Collect what is read from now on; what was reported before, and is still so, is news to its first reader."""
        if DIAGNOSTICS in topics and DIAGNOSTICS not in self._wanted:
            self._new_diagnostics = list(self._diagnostics.values())
        if QUALITIES in topics and QUALITIES not in self._wanted:
            self._new_qualities = dict(self._qualities)
        if MEASUREMENTS in topics and MEASUREMENTS not in self._wanted:
            self._new_measured = self._measured
        self._wanted = topics

    def take(self, status: ComponentStatus) -> SystemNews | None:
        """Return what is new, None if nothing is; it counts as reported from now on."""
        if status is self._seen and not self._has_more():
            return None
        self._seen = status
        state = ComponentState(status.component, status.incarnation, status.state, status.failure)
        told, self._state = self._state, state
        if state == told and not self._has_more():
            return None
        news = SystemNews(
            None if state == told else state,
            tuple(self._faults),
            tuple(self._new_diagnostics),
            tuple(self._new_qualities.values()),
            self._new_measured,
        )
        self._faults, self._new_diagnostics, self._new_qualities, self._new_measured = [], [], {}, None
        return news

    def _has_more(self) -> bool:
        return bool(self._faults or self._new_diagnostics or self._new_qualities or self._new_measured)
