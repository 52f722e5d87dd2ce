"""Publishes the outcome of adaptations: outputs, events, the manager's own status."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from regraft.adaptation_manager.journal.reports import EVENTS, summary
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationReport, Phase
from regraft.bus_schema.model.architecture import Architecture

SOON = 0.005
"""Seconds until a report is published, by the wall clock: until then the processor is free for the waiting client."""

if TYPE_CHECKING:
    from regraft import Kit, OutputPort


class JournalPublisher:
    """Messages that one manager publishes; ``current`` is the architecture as it should be now."""

    def __init__(
        self,
        kit: Kit,
        adaptations: OutputPort[AdaptationReport],
        architecture: OutputPort[Architecture],
        current: Callable[[], Architecture],
    ) -> None:
        self._kit = kit
        self._adaptations = adaptations
        self._architecture = architecture
        self._current = current

    def soon(self, report: AdaptationReport) -> None:
        """Report an adaptation that has ended, after its client has been answered."""
        self._kit.spawn(self._all(report), "telling")

    async def _all(self, report: AdaptationReport) -> None:
        if self._kit.tick is None:
            await self._kit.sleep(SOON)
        self.ended(report)
        if report.revision_after != report.revision_before or Phase.CONFIRM in (phase.phase for phase in report.phases):
            self.architecture()

    def begin(self) -> None:
        """Publish the architecture for the first time."""
        self._architecture.publish(self._current())

    def architecture(self) -> None:
        """Publish the architecture as it should be now."""
        if self._architecture.wanted:
            self._architecture.publish(self._current())

    def ended(self, report: AdaptationReport) -> None:
        """Report an adaptation that has ended."""
        if self._adaptations.wanted:
            self._adaptations.publish(report)
        phases = {phase.phase.value: phase.duration for phase in report.phases}
        details: dict[str, object] = {"id": report.id, "revision": report.revision_after, "phases": phases}
        if report.broken:
            details["broken"] = [codec.to_plain(breach) for breach in report.broken]
        if report.unreached:
            details["unreached"] = [codec.to_plain(unreached) for unreached in report.unreached]
        self._kit.event(EVENTS[report.outcome], summary(report), **details)
        self._kit.set_status_text(f"revision {self._current().revision}; last: {summary(report)}")
