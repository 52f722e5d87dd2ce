"""The buffer of a component on hold: messages are kept, within bounds, for it may have to continue seamlessly."""

from __future__ import annotations

from collections import Counter, deque
from typing import Protocol

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.runtime.data.replay_buffer import MAX_HELD, MAX_HELD_BYTES


class HeldInput(Protocol):
    """An input whose messages are kept."""

    def deliver(self, sample: Sample) -> None:
        """Take a sample in its turn."""

    def report_lost(self, source: str, count: int) -> None:
        """Count and report messages that never came."""


class HoldBuffer:
    """Messages of all inputs of one component, in the order in which they are to be handled.

    Beyond as many as are held for a run that takes over, the oldest go: they are lost if the component continues.
    """

    def __init__(self) -> None:
        self._kept: deque[tuple[HeldInput, Sample]] = deque()
        self._bytes = 0
        self._let_go: Counter[tuple[HeldInput, str]] = Counter()

    def keep(self, port: HeldInput, sample: Sample) -> None:
        """Keep one more."""
        self._kept.append((port, sample))
        self._bytes += len(sample.payload)
        while len(self._kept) > MAX_HELD or self._bytes > MAX_HELD_BYTES:
            other, oldest = self._kept.popleft()
            self._bytes -= len(oldest.payload)
            self._let_go[other, Envelope.from_bytes(oldest.attachment).source] += 1

    def give_out(self) -> None:
        """Hand everything to the inputs, which hold still no more."""
        for (port, source), count in self._let_go.items():
            port.report_lost(source, count)
        for port, sample in self._kept:
            port.deliver(sample)
        self._kept.clear()
