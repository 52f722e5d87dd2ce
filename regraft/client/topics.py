"""Looking at topics from outside."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from regraft.bus.interface import Closable, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.client.json_view import read_plain

MAX_WAITING = 256
"""Samples of one subscription that may wait for a slow callback; further ones are dropped and counted."""


@dataclass(frozen=True, slots=True)
class TopicSample:
    """One message as seen on a topic.

    ``stamp`` is in nanoseconds on the sender's clock, ``size`` in bytes. ``message`` is an instance of the class
    that was asked for. Without a class it is plain data, with arrays as numpy arrays.
    """

    topic: str
    type: str
    source: str
    incarnation: int
    sequence: int
    stamp: int
    size: int
    message: Any


class Subscription:
    """A look at a topic until it is closed, also by ``with``. ``refused`` counts messages that did not fit."""

    def __init__(self, topic: str, cls: type | None, callback: Callable[[TopicSample], object]) -> None:
        """Hand what comes to ``callback``."""
        self.topic = topic
        self.refused = 0
        self.dropped = 0
        self.last_problem = ""
        self._cls = cls
        self._callback = callback
        self._lock = threading.Lock()
        self._waiting = 0
        self._closable: Closable | None = None

    def begin(self, closable: Closable) -> Subscription:
        """Remember what ends it."""
        self._closable = closable
        return self

    def close(self) -> None:
        """Look no more; again does nothing."""
        if self._closable:
            self._closable.close()

    def __enter__(self) -> Subscription:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def admit(self) -> bool:
        """Return whether one more sample may wait for the callback."""
        with self._lock:
            if self._waiting >= MAX_WAITING:
                self.dropped += 1
                return False
            self._waiting += 1
            return True

    def miss(self) -> None:
        """Count a sample that could not be opened among those that were dropped."""
        with self._lock:
            self._waiting -= 1
            self.dropped += 1

    def take(self, sample: Sample) -> None:
        """Read a sample and hand it on; what does not fit is counted."""
        with self._lock:
            self._waiting -= 1
        try:
            envelope = Envelope.from_bytes(sample.attachment)
            if envelope.kind is Kind.MARKER:
                return
            seen = self._read(envelope, sample)
        except BadMessage as error:
            self.refused += 1
            self.last_problem = str(error)
            return
        self._callback(seen)

    def _read(self, envelope: Envelope, sample: Sample) -> TopicSample:
        name = sample.encoding.partition(";")[2] or sample.encoding
        if self._cls is None:
            message = read_plain(sample.payload, sample.encoding)
        elif codec.encoding_fits(sample.encoding, type_of(self._cls)):
            message = codec.decode(sample.payload, self._cls)
        else:
            raise BadMessage(f"is of the type {name!r}, must be {type_of(self._cls).name!r}")
        return TopicSample(
            self.topic,
            name,
            envelope.source,
            envelope.incarnation,
            envelope.sequence,
            envelope.stamp,
            len(sample.payload),
            message,
        )
