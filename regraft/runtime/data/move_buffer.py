"""An input on its way from one key to another."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.runtime.data.replay_buffer import MAX_HELD, MAX_HELD_BYTES


@dataclass(slots=True)
class MoveBuffer:
    """An input on its way to another key: what has arrived there waits until the switch.

    ``marks`` holds, per source, the incarnation and sequence of its first marker: what lies behind it is ours.
    Nobody may be there to switch it. So beyond as much as is held for a run that takes over, the oldest go.
    """

    key: str
    marks: dict[str, tuple[int, int]] = field(default_factory=dict)
    _held: deque[Sample] = field(default_factory=deque)
    _bytes: int = 0
    _let_go: dict[str, tuple[int, int]] = field(default_factory=dict)
    """By source how many went, and the sequence of the last of them."""

    def keep(self, sample: Sample) -> None:
        """Keep one more."""
        self._held.append(sample)
        self._bytes += len(sample.payload)
        while len(self._held) > MAX_HELD or self._bytes > MAX_HELD_BYTES:
            oldest = self._held.popleft()
            self._bytes -= len(oldest.payload)
            envelope = Envelope.from_bytes(oldest.attachment)
            count, _ = self._let_go.get(envelope.source, (0, 0))
            self._let_go[envelope.source] = (count + 1, envelope.sequence)

    def ours(self) -> list[Sample]:
        """Return what is to be handled after the switch, in the order of arrival."""
        opened = [(Envelope.from_bytes(sample.attachment), sample) for sample in self._held]
        return [sample for e, sample in opened if e.sequence > self._mark(e.source)]

    def lost(self) -> dict[str, int]:
        """Return how many went that were to be handled after the switch, by source."""
        found = {source: min(count, last - self._mark(source)) for source, (count, last) in self._let_go.items()}
        return {source: count for source, count in found.items() if count > 0}

    def _mark(self, source: str) -> int:
        return self.marks.get(source, (0, 0))[1]
