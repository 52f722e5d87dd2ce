"""The buffer of messages that reach a run before it handles them, within bounds."""

from __future__ import annotations

from collections import deque

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.handover import Place

MAX_HELD = 20_000
MAX_HELD_BYTES = 64 * 1024 * 1024
"""Beyond these the oldest samples go; a run that takes over never misses them, for its incumbent has handled them."""

First = dict[str, dict[str, Place]]


def envelope_of(sample: Sample) -> Envelope | None:
    """Return a sample's envelope, None if it has none."""
    try:
        return Envelope.from_bytes(sample.attachment)
    except BadMessage:
        return None


class ReplayBuffer:
    """Samples in the order of their arrival."""

    def __init__(self) -> None:
        self.samples: deque[Sample] = deque()
        self.first: First = {}
        self._bytes = 0
        self._taken = 0
        self._marked = 0

    def add(self, sample: Sample, envelope: Envelope | None) -> None:
        """Keep one more."""
        self.samples.append(sample)
        self._taken += 1
        self._bytes += len(sample.payload)
        if envelope is not None:
            behind = envelope.sequence + 1 if envelope.kind is Kind.MARKER else envelope.sequence
            self._begin(sample.key, envelope, behind, anew=False)
        while len(self.samples) > MAX_HELD or self._bytes > MAX_HELD_BYTES:
            self._let_go()

    def _begin(self, key: str, envelope: Envelope, sequence: int, *, anew: bool) -> None:
        sources = self.first.setdefault(key, {})
        place = sources.get(envelope.source)
        if place is None or envelope.epoch > place.epoch or (anew and envelope.epoch == place.epoch):
            sources[envelope.source] = Place(envelope.epoch, sequence)

    def _let_go(self) -> None:
        sample = self.samples.popleft()
        self._bytes -= len(sample.payload)
        envelope = envelope_of(sample)
        if envelope is not None and envelope.kind is Kind.DATA:
            self._begin(sample.key, envelope, envelope.sequence + 1, anew=True)

    def mark(self) -> None:
        """Remember that what comes from now on comes after this."""
        self._marked = self._taken

    def since_mark(self) -> list[Sample]:
        """Return what has come since the mark."""
        samples = list(self.samples)
        return samples[max(0, len(samples) - (self._taken - self._marked)) :]

    def take_all(self) -> list[Sample]:
        """Return everything, and hold nothing any more."""
        samples = list(self.samples)
        self.samples.clear()
        self.first.clear()
        self._bytes = 0
        return samples


def is_held(first: First, key: str, envelope: Envelope) -> bool:
    """Return whether a run that holds everything from ``first`` on holds this sample, or has seen this marker."""
    place = first.get(key, {}).get(envelope.source)
    if place is None:
        return False
    sequence = envelope.sequence + 1 if envelope.kind is Kind.MARKER else envelope.sequence
    return (envelope.epoch, sequence) >= (place.epoch, place.sequence)
