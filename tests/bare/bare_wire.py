"""What docs/protocol.md says of bytes and sequences, written from that page alone: zenoh, msgpack, standard library."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable
from typing import Any

import msgpack
import zenoh

ENVELOPE = struct.Struct("<BBHIIQq")
DATA, MARKER = 0, 1
HOLE_TIMEOUT = 0.05
PLAIN_ENCODING = "application/msgpack;{}@1"

Plain = dict[str, Any]
Held = tuple[str, Plain]
"""A sample that waits to be handled: its key; its source, sequence, encoding and payload."""


class Bad(Exception):
    """Bytes that are not what they should be."""


def packed(message: Plain) -> bytes:
    """Return a message's payload."""
    data: bytes = msgpack.packb(message)
    return data


def unpacked(payload: bytes) -> Plain:
    """Return the message in a payload; raises Bad."""
    try:
        message = msgpack.unpackb(payload)
    except (ValueError, TypeError, msgpack.exceptions.UnpackException) as error:
        raise Bad(f"is not MessagePack: {error}") from None
    if not isinstance(message, dict):
        raise Bad("is not a map")
    return message


def open_session(endpoints: list[str], secret: str, *, stepped: bool) -> zenoh.Session:
    """Join the system as a client of its hub."""
    config = zenoh.Config()
    settings = {
        "mode": "client",
        "connect/endpoints": endpoints,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": 1000,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": 15_000_000 if stepped else 400_000,
    }
    if secret:
        settings |= {"transport/auth/usrpwd/user": "regraft", "transport/auth/usrpwd/password": secret}
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


class Writer:
    """One key that this process writes: its publisher and its numbering."""

    def __init__(
        self, session: zenoh.Session, key: str, type_name: str, source: str, epoch: int, incarnation: int
    ) -> None:
        """Start behind sequence 0."""
        self.key = key
        self.sequence = 0
        self._head = (epoch, incarnation)
        self._source = source.encode()
        self._encoding = PLAIN_ENCODING.format(type_name)
        self._session = session
        self._publisher = self._declare()

    def _declare(self) -> Any:
        block = zenoh.CongestionControl.BLOCK
        return self._session.declare_publisher(self.key, encoding=self._encoding, congestion_control=block)

    def _attachment(self, kind: int, stamp: int) -> bytes:
        return ENVELOPE.pack(2, kind, 0, *self._head, self.sequence, stamp) + self._source

    def put(self, message: Plain, stamp: int) -> None:
        """Put the next message."""
        self.sequence += 1
        self._publisher.put(packed(message), attachment=self._attachment(DATA, stamp))

    def mark(self, stamp: int) -> None:
        """Put a marker: how far the numbering has come."""
        self._publisher.put(b"", attachment=self._attachment(MARKER, stamp))

    def wait_for_reader(self, seconds: float) -> None:
        """Before the first sample at a key: wait, bounded, until somebody subscribes."""
        deadline = time.monotonic() + seconds
        while not self._publisher.matching_status.matching and time.monotonic() < deadline:
            time.sleep(0.001)

    def close(self) -> None:
        """Undeclare the key; the numbering stays."""
        self._publisher.undeclare()

    def open_again(self) -> None:
        """Declare the key again; the numbering goes on."""
        self._publisher = self._declare()


class Stream:
    """One source on one key, put back into sequence."""

    def __init__(self) -> None:
        self.epoch = 0
        self.incarnation = 0
        self.handled: int | None = None
        self.wired = False
        self.waiting: dict[int, Held] = {}
        self.waiting_since = 0.0
        self.lost = 0

    def admit(self, epoch: int, incarnation: int) -> bool:
        """Tell whether a sample comes from the living run; a newer epoch begins at 0."""
        if epoch < self.epoch or incarnation < self.incarnation:
            return False
        if epoch > self.epoch:
            self.handled = 0 if self.epoch else None
            self.epoch, self.wired = epoch, False
            self.waiting.clear()
        self.incarnation = incarnation
        return True

    def mark(self, sequence: int) -> None:
        """Take a marker; only the first one counts."""
        if not self.wired:
            self.wired = True
            self.handled = max(self.handled or 0, sequence)
            self.waiting = {n: held for n, held in self.waiting.items() if n > sequence}

    def pass_by(self, sequence: int) -> None:
        """Let a sample go by while nobody reads."""
        self.wired = False
        self.waiting.clear()
        self.handled = max(self.handled or 0, sequence)

    def take(self, sequence: int, held: Held) -> list[Held]:
        """Real clock: return what can be handled now."""
        if self.handled is None:
            self.handled = sequence - 1
        if sequence > self.handled:
            if not self.waiting:
                self.waiting_since = time.monotonic()
            self.waiting.setdefault(sequence, held)
        return self._in_sequence()

    def overdue(self) -> list[Held]:
        """Real clock: give up on a hole that stayed open for too long."""
        if not self.waiting or time.monotonic() - self.waiting_since < HOLE_TIMEOUT:
            return []
        first = min(self.waiting)
        self.lost += first - (self.handled or 0) - 1
        self.handled = first - 1
        self.waiting_since = time.monotonic()
        return self._in_sequence()

    def _in_sequence(self) -> list[Held]:
        ready = []
        while self.handled is not None and self.handled + 1 in self.waiting:
            self.handled += 1
            ready.append(self.waiting.pop(self.handled))
        return ready

    def hold(self, sequence: int, held: Held) -> None:
        """Simulated time: keep a sample until its step."""
        if self.handled is None or sequence > self.handled:
            self.waiting.setdefault(sequence, held)

    def reaches(self, frontier: int) -> bool:
        """Simulated time: tell whether everything up to ``frontier`` is here."""
        return all(n in self.waiting for n in range((self.handled or 0) + 1, frontier + 1))

    def release(self, frontier: int) -> list[Held]:
        """Simulated time: give out everything up to ``frontier``."""
        start = self.handled or 0
        ready = [self.waiting.pop(n) for n in range(start + 1, frontier + 1) if n in self.waiting]
        self.lost += max(0, frontier - start) - len(ready)
        self.handled = max(start, frontier)
        return ready

    def release_all(self) -> list[Held]:
        """Simulated time: give out all that is here, of a source that is no member."""
        numbers = sorted(self.waiting)
        if numbers:
            self.handled = numbers[-1]
        return [self.waiting.pop(n) for n in numbers]


class Streams:
    """All that comes in, by key and source."""

    def __init__(self, on_marker: Callable[[str, str, Stream], None]) -> None:
        """Tell ``on_marker`` of every marker."""
        self.by_pair: dict[tuple[str, str], Stream] = {}
        self._on_marker = on_marker

    def arrive(self, sample: zenoh.Sample, *, paused: bool, stepped: bool) -> list[Held]:
        """Take a sample; returns what can be handled at once. Raises Bad."""
        attachment = sample.attachment.to_bytes() if sample.attachment is not None else b""
        if len(attachment) <= ENVELOPE.size or len(attachment) > ENVELOPE.size + 160 or attachment[0] != 2:
            raise Bad("has no envelope")
        _, kind, _, epoch, incarnation, sequence, _ = ENVELOPE.unpack_from(attachment)
        key, source = str(sample.key_expr), attachment[ENVELOPE.size :].decode(errors="replace")
        stream = self.by_pair.setdefault((key, source), Stream())
        if not stream.admit(epoch, incarnation):
            raise Bad(f"comes from incarnation {incarnation} of {source}, which has been replaced")
        if kind == MARKER:
            stream.mark(sequence)
            self._on_marker(key, source, stream)
            return []
        if paused:
            stream.pass_by(sequence)
            return []
        encoding, payload = str(sample.encoding), sample.payload.to_bytes()
        held = (key, {"source": source, "sequence": sequence, "encoding": encoding, "payload": payload})
        if stepped:
            stream.hold(sequence, held)
            return []
        return stream.take(sequence, held)

    def overdue(self) -> list[Held]:
        """Return what lies behind holes that have stayed open for too long."""
        return [held for stream in self.by_pair.values() for held in stream.overdue()]

    @property
    def lost(self) -> int:
        """How many messages never came."""
        return sum(stream.lost for stream in self.by_pair.values())

    def forget(self, key: str) -> None:
        """Forget a key that is read no more."""
        for pair in [pair for pair in self.by_pair if pair[0] == key]:
            del self.by_pair[pair]

    def unwire(self, key: str) -> None:
        """Let the next marker on ``key`` count as the first."""
        for (stream_key, _), stream in self.by_pair.items():
            if stream_key == key:
                stream.wired = False
                stream.waiting.clear()

    def restart(self, sources: set[str] | None = None) -> None:
        """Drop queues and positions, of some sources or of all; who has been replaced stays known."""
        for (_, source), stream in self.by_pair.items():
            if sources is None or source in sources:
                stream.handled, stream.wired = None, False
                stream.waiting.clear()
