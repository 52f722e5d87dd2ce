"""Announces decisions and failures of a metacontroller: events, diagnostics, and the text of its status."""

from __future__ import annotations

from regraft import Kit, Level
from regraft.adaptation_manager.planners.metacontrol.control.doubts import Doubts
from regraft.bus_schema.messages.management.objectives import ObjectivesStatus


class DecisionLog:
    """The announcements of a metacontroller while it is active; nothing is repeated."""

    def __init__(self, kit: Kit) -> None:
        self._kit = kit
        self._complaint = ""
        self._doubts = Doubts()

    def complain(self, kind: str, text: str) -> None:
        """Announce why nothing could be decided, or carried out."""
        if text != self._complaint:
            self._complaint = text
            self._kit.event(kind, text)
            self._kit.diagnose("objectives", Level.ERROR, text)

    def be_well(self) -> None:
        """Announce that a complaint is over."""
        if self._complaint:
            self._complaint = ""
            self._kit.diagnose("objectives", Level.OK, "decided")

    def doubt(self, text: str) -> None:
        """Announce a diagnostic that cannot be right."""
        report = self._doubts.report_of(text, self._kit.now())
        if report:
            self._kit.event("metacontrol.implausible", report)

    def show(self, found: ObjectivesStatus) -> None:
        """Show what provides each objective."""
        texts = [f"{each.objective}: {each.realization or each.state.value}" for each in found.objectives]
        self._kit.set_status_text(", ".join(texts) or "no objectives")
