"""The last samples that a writer has put or deferred, for readers that have not got them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection

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


class History:
    """Samples of one key in the order in which they were put or made; the oldest are dropped."""

    __slots__ = ("_bytes", "_deferred", "_sent")

    def __init__(self) -> None:
        self._sent: OrderedDict[Place, Sent] = OrderedDict()
        self._deferred: OrderedDict[Place, Deferred] = OrderedDict()
        self._bytes = 0

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

    def take_deferred(self, epoch: int, first: int, last: int) -> dict[Place, Deferred]:
        """Return what was deferred of the sequences ``first`` to ``last`` of an epoch, to be made now."""
        return {place: self._deferred.pop(place) for place in _within(self._deferred, epoch, first, last)}

    def take_last_deferred(self) -> dict[Place, Deferred]:
        """Return the newest of what was deferred, if any, to be made now; the others are dropped."""
        newest = dict([self._deferred.popitem()] if self._deferred else [])
        self._deferred.clear()
        return newest

    def at(self, place: Place) -> Sent | None:
        """Return a sample that is kept."""
        return self._sent.get(place)

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


def _within(places: Collection[Place], epoch: int, first: int, last: int) -> list[Place]:
    """Return the places of an epoch from ``first`` to ``last``, in sequence; most questions are for a few of many."""
    if last - first < len(places):
        return [(epoch, n) for n in range(first, last + 1) if (epoch, n) in places]
    return sorted(place for place in places if place[0] == epoch and first <= place[1] <= last)
