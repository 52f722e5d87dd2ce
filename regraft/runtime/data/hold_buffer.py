"""The buffer of a component on hold: messages are kept, within bounds, for it may have to continue seamlessly."""

from __future__ import annotations

from collections import Counter, deque

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope
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
