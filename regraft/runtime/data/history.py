"""The last samples that a writer has put, for readers that have not got them."""

from __future__ import annotations

from collections import deque

from regraft.bus_schema.encoding.envelope import Envelope

MAX_KEPT = 2048
"""Samples that are kept: two seconds at 1 kHz."""
MAX_BYTES = 32 * 1024 * 1024
"""Bytes of payload that are kept, unless they are of the last two samples: a second of 0.9 MB pictures at 30 Hz."""
ALWAYS_KEPT = 2
MAX_RESENT = 4 * 1024 * 1024
"""Bytes of payload in one answer, unless it is of one sample."""

Sent = tuple[bytes, bytes]
"""Payload and attachment of a sample."""


class History:
    """Samples of one key in the order in which they were put; the oldest are dropped."""

    __slots__ = ("_bytes", "_sent")

    def __init__(self) -> None:
        self._sent: deque[Sent] = deque()
        self._bytes = 0

    def keep(self, payload: bytes, attachment: bytes) -> None:
        """Keep a sample that is being put."""
        sent = self._sent
        sent.append((payload, attachment))
        self._bytes += len(payload)
        while len(sent) > MAX_KEPT or (self._bytes > MAX_BYTES and len(sent) > ALWAYS_KEPT):
            self._bytes -= len(sent.popleft()[0])

    def find(self, epoch: int, first: int, last: int) -> list[Sent]:
        """Return what is kept of the sequences ``first`` to ``last`` of an epoch, as much as one answer holds."""
        found: list[Sent] = []
        size = 0
        for payload, attachment in self._sent:
            envelope = Envelope.from_bytes(attachment)
            if envelope.epoch != epoch or not first <= envelope.sequence <= last:
                continue
            size += len(payload)
            if found and size > MAX_RESENT:
                break
            found.append((payload, attachment))
        return found
