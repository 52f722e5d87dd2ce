"""From which checkpoint the next run of a component starts, if from any."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import Snapshot


@dataclass(slots=True)
class StartingCheckpoint:
    """The payload of the last Snapshot that a component has put, empty before the first.

    ``counts_from`` is the incarnation from which on checkpoints count: that of the present one, or beyond a run on
    trial that was undone. It is 0 for one of a run elsewhere, from which a run here starts.
    """

    payload: bytes = b""
    counts_from: int = 0

    def take(self, payload: bytes, incarnation: int) -> None:
        """Take the checkpoint of a run, if it counts."""
        if incarnation >= self.counts_from:
            self.payload, self.counts_from = payload, incarnation

    def resume(self, payload: bytes) -> None:
        """Have the next run start from a checkpoint that was heard of elsewhere; an empty one changes nothing."""
        self.payload = payload or self.payload

    def forget(self) -> None:
        """Have the next run start afresh."""
        self.payload = b""

    def go_back(self, payload: bytes, incarnation: int) -> None:
        """Have the next run start from an earlier checkpoint; those of the runs until ``incarnation`` count no more."""
        self.payload, self.counts_from = payload, incarnation + 1

    def opened(self) -> Snapshot | None:
        """Return the state to start from, None to start afresh. It is opened only now: one comes in every tick."""
        try:
            return codec.decode(self.payload, Snapshot) if self.payload else None
        except BadMessage:
            return None
