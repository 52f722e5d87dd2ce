"""The history of runs that this host does not run now, from which the next run continues."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.messages.protocol.joining import PastRun

MAX_NAMES = 1000


@dataclass(slots=True)
class _Known:
    incarnation: int = 0
    checkpoint: bytes = b""


class RunHistory:
    """The highest incarnation and the last checkpoint of each component that was heard of."""

    def __init__(self) -> None:
        self._known: dict[str, _Known] = {}

    def note(self, component: str, incarnation: int, checkpoint: bytes = b"") -> None:
        """Note a run; that of a lower incarnation than known counts for nothing."""
        known = self._known.setdefault(component, _Known())
        if incarnation >= known.incarnation:
            known.incarnation = incarnation
            known.checkpoint = checkpoint or known.checkpoint
        while len(self._known) > MAX_NAMES:
            del self._known[next(iter(self._known))]

    def go_back(self, component: str, checkpoint: bytes) -> None:
        """Have an earlier checkpoint as the last one; those of the runs that were heard of count no more."""
        known = self._known.get(component)
        if known is not None:
            known.incarnation, known.checkpoint = known.incarnation + 1, checkpoint

    def take(self, component: str, what: str, sample: Sample) -> None:
        """Take a status or a checkpoint from elsewhere; raises BadMessage."""
        incarnation = Envelope.from_bytes(sample.attachment).incarnation
        self.note(component, incarnation, sample.payload if what == "checkpoint" else b"")

    def incarnation(self, component: str) -> int:
        """Return the highest incarnation that was heard of, 0 for none."""
        known = self._known.get(component)
        return known.incarnation if known else 0

    def checkpoint(self, component: str) -> bytes:
        """Return the payload of the last checkpoint, empty for none."""
        known = self._known.get(component)
        return known.checkpoint if known else b""

    def of(self, component: str) -> PastRun:
        """Return all that is known of a component."""
        return PastRun(component, self.incarnation(component), self.checkpoint(component))
