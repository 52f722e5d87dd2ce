"""What comes for a component that only holds still: kept, within bounds, for it may have to go on as if nothing was."""

from __future__ import annotations

from collections import Counter, deque
from typing import TYPE_CHECKING, Any

from bus_schema.encoding.envelope import Envelope
from regraft.bus import Sample
from regraft.runtime.held import MOST_HELD, MOST_HELD_BYTES

if TYPE_CHECKING:
    from regraft.runtime.inputs import InputPort


class Stillness:
    """Messages of all inputs of one component, in the order in which they are to be handled.

    Beyond as many as are held for a run that takes over, the oldest go: they are lost if the component goes on.
    """

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._kept: deque[tuple[InputPort[Any], Sample]] = deque()
        self._bytes = 0
        self._let_go: Counter[tuple[InputPort[Any], str]] = Counter()

    def keep(self, port: InputPort[Any], sample: Sample) -> None:
        """Keep one more."""
        self._kept.append((port, sample))
        self._bytes += len(sample.payload)
        while len(self._kept) > MOST_HELD or self._bytes > MOST_HELD_BYTES:
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
