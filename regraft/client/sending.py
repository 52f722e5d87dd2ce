"""Messages that a client puts on the bus: numbered per key, as every source's samples are."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

from regraft.bus.interface import Bus, Publisher
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of

WAIT_FOR_READER = 0.2
"""Seconds after which a new key waits no longer for somebody to subscribe."""
MATCH_POLL = 0.002


@dataclass(slots=True)
class _Line:
    publisher: Publisher
    wait_until: float
    """When the wait for a reader is over, by the monotonic clock; in the past once there was one."""
    sequence: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def wait_for_reader(self) -> None:
        """Wait until somebody subscribes, at most until the line's time for that is over."""
        while time.monotonic() < self.wait_until:
            if self.publisher.matched:
                self.wait_until = 0.0
                return
            time.sleep(MATCH_POLL)


class Sender:
    """Puts messages in the client's name. Thread-safe; the numbering of a key is that of its puts."""

    def __init__(self, bus: Bus, source: str) -> None:
        """Put as ``source``, whose epoch and incarnation are 1: a client lives once."""
        self._bus = bus
        self._source = source
        self._lock = threading.Lock()
        self._lines: dict[str, _Line] = {}

    def put(self, key: str, message: object) -> None:
        """Put a message; raises BusError."""
        self.put_payload(key, codec.encode(message), type_of(type(message)).encoding)

    def put_payload(self, key: str, payload: bytes, encoding: str) -> None:
        """Put a message that is encoded already; raises BusError."""
        line = self._line(key, encoding)
        line.wait_for_reader()  # outside the lock: others that put at the key wait at the same time, not one by one
        with line.lock:
            line.sequence += 1
            envelope = Envelope(self._source, 1, 1, line.sequence, time.time_ns())
            line.publisher.put(payload, envelope.to_bytes())

    def matched(self, key: str) -> bool:
        """Return whether somebody subscribes to a key that was put at before."""
        line = self._lines.get(key)
        return line is not None and line.publisher.matched

    def reaches(self, key: str, encoding: str) -> bool:
        """Return whether somebody subscribes to a key; whether it was put at before or not. Raises BusError."""
        line = self._line(key, encoding)
        line.wait_for_reader()
        return line.publisher.matched

    def _line(self, key: str, encoding: str) -> _Line:
        with self._lock:
            line = self._lines.get(key)
            if line is None:
                publisher = self._bus.publisher(key, encoding, reliable=True)
                line = self._lines[key] = _Line(publisher, time.monotonic() + WAIT_FOR_READER)
            return line

    def close(self) -> None:
        """Undeclare all keys."""
        with self._lock:
            for line in self._lines.values():
                line.publisher.close()
            self._lines.clear()
