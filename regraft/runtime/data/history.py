"""The last samples that a writer has put or deferred, for readers that have not got them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Container, Iterable, Sized
from typing import Protocol

MAX_KEPT = 2048
"""Samples that are kept, and as many that are deferred: two seconds at 1 kHz."""
MAX_BYTES = 32 * 1024 * 1024
"""Bytes of payload that are kept, unless they are of the last two samples: a second of 0.9 MB pictures at 30 Hz."""
ALWAYS_KEPT = 2
MAX_RESENT = 4 * 1024 * 1024
"""Bytes of payload in one answer, unless it is of one sample."""

Sent = tuple[bytes, bytes]
"""Payload and attachment of a sample."""
Deferred = tuple[Callable[[], bytes], bytes]
"""Returns the payload of a sample that nobody has opened, and its attachment."""
Place = tuple[int, int]
"""Epoch and sequence of a sample."""


class _Places(Container[Place], Iterable[Place], Sized, Protocol):
    """The places of some samples."""


class History:
    """Samples of one key in the order in which they were put or made; the oldest are dropped.

    ``making`` has the places of those that are being made: that may take questions to others.
    """

    __slots__ = ("_bytes", "_deferred", "_sent", "making")

    def __init__(self) -> None:
        self._sent: OrderedDict[Place, Sent] = OrderedDict()
        self._deferred: OrderedDict[Place, Deferred] = OrderedDict()
        self._bytes = 0
        self.making: set[Place] = set()

    def keep(self, place: Place, payload: bytes, attachment: bytes) -> None:
        """Keep a sample that is being put."""
        sent = self._sent
        sent[place] = payload, attachment
        self._bytes += len(payload)
        while len(sent) > MAX_KEPT or (self._bytes > MAX_BYTES and len(sent) > ALWAYS_KEPT):
            self._bytes -= len(sent.popitem(last=False)[1][0])

    def defer(self, place: Place, make: Callable[[], bytes], attachment: bytes) -> None:
        """Keep a sample that is made when a reader asks for it."""
        self._deferred[place] = make, attachment
        if len(self._deferred) > MAX_KEPT:
            self._deferred.popitem(last=False)

    def make_deferred(self, epoch: int, first: int, last: int) -> None:
        """Make what was deferred of the sequences ``first`` to ``last`` of an epoch; raises what making one raises."""
        for place in _within(self._deferred, epoch, first, last):
            if place in self._deferred:  # else it was made for somebody else while the one before was being made
                self._make(place)

    def make_last_deferred(self) -> None:
        """Make the newest of what was deferred, and drop the others; raises what making it raises."""
        if self._deferred:
            newest = next(reversed(self._deferred))
            try:
                self._make(newest)
            finally:
                self._deferred.clear()

    def _make(self, place: Place) -> None:
        make, attachment = self._deferred.pop(place)
        self.making.add(place)
        try:
            self.keep(place, make(), attachment)
        finally:
            self.making.discard(place)

    def find(self, epoch: int, first: int, last: int) -> list[Sent]:
        """Return what is kept of the sequences ``first`` to ``last`` of an epoch, as much as one answer holds."""
        found: list[Sent] = []
        size = 0
        for place in _within(self._sent, epoch, first, last):
            payload, attachment = self._sent[place]
            size += len(payload)
            if found and size > MAX_RESENT:
                break
            found.append((payload, attachment))
        return found


def _within(places: _Places, epoch: int, first: int, last: int) -> list[Place]:
    """Return the places of an epoch from ``first`` to ``last``, in sequence; most questions are for a few of many."""
    if last - first < len(places):
        return [(epoch, n) for n in range(first, last + 1) if (epoch, n) in places]
    return sorted(place for place in places if place[0] == epoch and first <= place[1] <= last)
