"""All that goes out: every key that a component writes has one numbering, kept by a writer."""

from __future__ import annotations

import time
from dataclasses import dataclass
from threading import get_ident

from bus_schema.envelope import PLACE, Kind, run_part
from regraft.bus import Bus, Publisher
from regraft.clock import Clock

MATCH_POLL = 0.001


@dataclass(frozen=True, slots=True)
class Identity:
    """Who writes: a component's name, the epoch of its numbering, and its incarnation."""

    name: str
    epoch: int
    incarnation: int


class Writer:
    """Numbers and puts the samples of one key."""

    __slots__ = ("_data", "_marker", "_now", "_publisher", "_source", "_writers", "key", "sequence")

    def __init__(self, writers: Writers, key: str, publisher: Publisher) -> None:
        """Start behind sequence 0."""
        self.key = key
        self.sequence = 0
        self._writers = writers
        self._publisher = publisher
        self._now = writers.clock.now
        identity = writers.identity
        self._data = run_part(Kind.DATA, identity.epoch, identity.incarnation)
        self._marker = run_part(Kind.MARKER, identity.epoch, identity.incarnation)
        self._source = identity.name.encode()

    def put(self, payload: bytes) -> None:
        """Put the next sample; from any thread but the component's own it would break the numbering."""
        writers = self._writers
        if get_ident() != writers.thread:
            raise RuntimeError("publish from the component's own thread; let compute() return what is to be published")
        self.sequence = sequence = self.sequence + 1
        writers.advanced[self.key] = sequence
        self._publisher.put(payload, self._data + PLACE.pack(sequence, self._now()) + self._source)

    def mark(self) -> None:
        """Put a marker: it says how far the numbering has come."""
        self._publisher.put(b"", self._marker + PLACE.pack(self.sequence, self._now()) + self._source)

    @property
    def matched(self) -> bool:
        """Whether somebody subscribes."""
        return self._publisher.matched

    def wait_for_reader(self, seconds: float) -> bool:
        """Wait until somebody subscribes: what is put at a fresh key before that may reach nobody."""
        deadline = time.monotonic() + seconds
        while not self._publisher.matched:
            if time.monotonic() > deadline:
                return False
            time.sleep(MATCH_POLL)
        return True

    def close(self) -> None:
        """Undeclare the key; its numbering is remembered."""
        self._publisher.close()


class Writers:
    """The writers of one component. ``advanced`` collects what was put since it was last cleared."""

    def __init__(self, bus: Bus, clock: Clock, identity: Identity) -> None:
        """Start without keys."""
        self.bus = bus
        self.clock = clock
        self.identity = identity
        self.advanced: dict[str, int] = {}
        self.open_keys: dict[str, Writer] = {}
        self._numbering: dict[str, int] = {}
        self.thread = get_ident()

    def open(self, key: str, encoding: str, *, reliable: bool = True) -> Writer:
        """Declare a key to write, going on with its numbering if it had one."""
        writer = self.open_keys.get(key)
        if writer is None:
            writer = Writer(self, key, self.bus.publisher(key, encoding, reliable=reliable))
            writer.sequence = self._numbering.get(key, 0)
            self.open_keys[key] = writer
        return writer

    def close(self, key: str) -> None:
        """Undeclare a key."""
        writer = self.open_keys.pop(key, None)
        if writer:
            self._numbering[key] = writer.sequence
            writer.close()

    def sequences(self) -> dict[str, int]:
        """Return the last sequence of every key."""
        return {key: writer.sequence for key, writer in self.open_keys.items()}

    def close_all(self) -> None:
        """Undeclare every key."""
        for key in list(self.open_keys):
            self.close(key)
