"""The buffer of a component on hold, and what becomes of it: messages are kept, within bounds, for it may continue."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.runtime.core.overlap import Overlap
from regraft.runtime.data.inbound import Consumer
from regraft.runtime.data.replay_buffer import MAX_HELD, MAX_HELD_BYTES


class HoldBuffer:
    """Messages of all inputs of one component, in the order in which they are to be handled.

    Beyond as many as are held for a run that takes over, the oldest go: they are lost if the component continues.
    """

    def __init__(self) -> None:
        self._kept: deque[tuple[Consumer, Sample]] = deque()
        self._bytes = 0
        self._let_go: Counter[tuple[Consumer, str]] = Counter()

    def keep(self, port: Consumer, sample: Sample) -> None:
        """Keep one more."""
        self._kept.append((port, sample))
        self._bytes += len(sample.payload)
        while len(self._kept) > MAX_HELD or self._bytes > MAX_HELD_BYTES:
            other, oldest = self._kept.popleft()
            self._bytes -= len(oldest.payload)
            self._let_go[other, Envelope.from_bytes(oldest.attachment).source] += 1

    def take_all(self) -> list[tuple[Consumer, Sample]]:
        """Report what was lost, and return the rest: the inputs hold still no more."""
        for (port, source), count in self._let_go.items():
            port.report_lost(source, count)
        kept = list(self._kept)
        self._kept.clear()
        return kept


class Backlog:
    """The samples that were kept for one input and that have no room in its handler yet; then those behind them.

    As much waits at a time as was kept. All beyond that is left out.
    """

    def __init__(self, overlap: Overlap, hand_on: Callable[[Sample], None]) -> None:
        """Hand samples on to the handler whose calls are in ``overlap``."""
        self._overlap = overlap
        self._hand_on = hand_on
        self.waiting: deque[Sample] = deque()
        self._bytes = self._expected = self._most = self._most_bytes = 0
        overlap.when_room = self._catch_up

    def expect(self, kept: list[Sample]) -> None:
        """Leave none of these samples out: they are the next to come."""
        self._expected += len(kept)
        self._most += len(kept)
        self._most_bytes += sum(len(sample.payload) for sample in kept)

    def take(self, sample: Sample) -> None:
        """Hand a sample on in its turn."""
        was_kept, self._expected = self._expected > 0, max(0, self._expected - 1)
        if not self._most or (self._overlap.has_room and not self.waiting):
            self._hand_on(sample)
        elif was_kept or self._fits(sample):
            self.waiting.append(sample)
            self._bytes += len(sample.payload)
        else:
            self._overlap.left_out()
        self._end_if_over()

    def _fits(self, sample: Sample) -> bool:
        return len(self.waiting) < self._most and self._bytes + len(sample.payload) <= self._most_bytes

    def _catch_up(self) -> None:
        while self.waiting and self._overlap.has_room:
            sample = self.waiting.popleft()
            self._bytes -= len(sample.payload)
            self._hand_on(sample)
        self._end_if_over()

    def _end_if_over(self) -> None:
        if not (self._expected or self.waiting):
            self._most = self._most_bytes = 0

    def forget(self) -> None:
        """Drop what waits, and expect nothing more."""
        self.waiting.clear()
        self._bytes = self._expected = self._most = self._most_bytes = 0


@dataclass(slots=True)
class Move:
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
