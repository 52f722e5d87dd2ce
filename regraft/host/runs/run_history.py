"""The history of runs that this host does not run now, from which the next run continues."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import MAX_INCARNATION, Envelope
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.host import LEAVE_OUT
from regraft.bus_schema.messages.protocol.joining import PastRun
from regraft.host.runs.starting_checkpoint import StartingCheckpoint

MAX_NAMES = 1000
MAX_TAKEN = MAX_INCARNATION - 2 * LEAVE_OUT
"""The highest incarnation that is believed: a run that is started elsewhere after it leaves some out."""
NO_CHECKPOINT = StartingCheckpoint()


@dataclass(slots=True)
class _Known:
    incarnation: int = 0
    checkpoint: StartingCheckpoint = field(default_factory=StartingCheckpoint)


class RunHistory:
    """The highest incarnation and the last checkpoint of each component that was heard of.

    A run without a checkpoint leaves that of an earlier run alone: a successor may fail, and its incumbent continue.
    """

    def __init__(self) -> None:
        self._known: dict[str, _Known] = {}

    def note(self, component: str, incarnation: int, checkpoint: StartingCheckpoint = NO_CHECKPOINT) -> None:
        """Note a run, and its checkpoint unless one that counts from a later incarnation is known."""
        known = self._known.setdefault(component, _Known())
        known.incarnation = max(known.incarnation, incarnation)
        if checkpoint.counts_from >= known.checkpoint.counts_from:
            last = checkpoint.payload or known.checkpoint.payload
            known.checkpoint = StartingCheckpoint(last, checkpoint.counts_from)
        while len(self._known) > MAX_NAMES:
            del self._known[next(iter(self._known))]

    def go_back(self, component: str, checkpoint: bytes) -> None:
        """Have an earlier checkpoint as the last one; those of the runs that were heard of count no more."""
        known = self._known.get(component)
        if known is not None:
            known.checkpoint.go_back(checkpoint, known.incarnation)

    def take(self, component: str, what: str, sample: Sample) -> None:
        """Take a status or a checkpoint from elsewhere; raises BadMessage."""
        incarnation = Envelope.from_bytes(sample.attachment).incarnation
        if incarnation > MAX_TAKEN:
            raise BadMessage(f"has incarnation {incarnation}, must be at most {MAX_TAKEN}")
        has_state = what == "checkpoint"
        self.note(
            component, incarnation, StartingCheckpoint(sample.payload, incarnation) if has_state else NO_CHECKPOINT
        )

    def incarnation(self, component: str) -> int:
        """Return the highest incarnation that was heard of, 0 for none."""
        known = self._known.get(component)
        return known.incarnation if known else 0

    def checkpoint(self, component: str) -> bytes:
        """Return the payload of the last checkpoint, empty for none."""
        known = self._known.get(component)
        return known.checkpoint.payload if known else b""

    def of(self, component: str) -> PastRun:
        """Return all that is known of a component."""
        return PastRun(component, self.incarnation(component), self.checkpoint(component))
