"""All that goes out: every key that a component writes has one numbering, kept by a writer."""

from __future__ import annotations

import contextlib
import time
from collections import deque
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass
from threading import get_ident

from regraft.bus.interface import Bus, BusError, Publisher
from regraft.bus_schema.encoding.envelope import PLACE, Kind, run_part
from regraft.bus_schema.messages.protocol.control import Resend, Resent, ResentSample
from regraft.runtime.core.clock import Clock
from regraft.runtime.core.lease import HeldLease
from regraft.runtime.data.sent_history import Deferred, History, Place

MATCH_POLL = 0.001
MATCH_INTERVAL = 0.05
"""Seconds for which an answer counts, where messages are promised: to ask for each took 2 % of the world's time."""

MAX_RETIRED = 4096
"""Keys of clients that have gone, of which it is known how far the numbering had come."""

SMALL = 4096
"""Bytes of a sample that a step or its acknowledgement may carry."""


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity of a writer: a component's name, the epoch of its numbering, and its incarnation."""

    name: str
    epoch: int
    incarnation: int


class _Mute:
    """Replaces the publishers of a run that does not speak for its component."""

    matched = True

    def put(self, payload: bytes, attachment: bytes) -> None:
        pass

    def close(self) -> None:
        pass


class Writer:
    """Numbers and puts the samples of one key. ``fresh`` until it was waited for a reader."""

    __slots__ = (
        "_data",
        "_declared",
        "_history",
        "_marker",
        "_matched",
        "_matched_until",
        "_now",
        "_publisher",
        "_source",
        "_unmade",
        "_writers",
        "encoding",
        "fresh",
        "key",
        "sequence",
    )

    def __init__(self, writers: Writers, key: str, encoding: str, publisher: Publisher) -> None:
        """Start behind sequence 0."""
        self.key = key
        self.encoding = encoding
        self.sequence = 0
        self.fresh = True
        self._writers = writers
        self._declared = publisher
        self._now = writers.clock.now
        self._unmade: set[Place] = set()
        self._matched, self._matched_until = False, 0.0
        self._history: History | None = None
        self.speak()

    def speak(self) -> None:
        """Put as whom all writers of the component now put as; if they are mute, markers alone."""
        identity = self._writers.identity
        self._data = run_part(Kind.DATA, identity.epoch, identity.incarnation)
        self._marker = run_part(Kind.MARKER, identity.epoch, identity.incarnation)
        self._source = identity.name.encode()
        self._publisher: Publisher = _Mute() if self._writers.mute else self._declared
        self._matched_until = 0.0

    def put(self, payload: bytes) -> None:
        """Put the next sample; from any thread but the component's own it would break the numbering.

        While the component is mute, it is not even numbered: a reader would ask for what nobody had put.
        """
        if self._writers.mute:
            return
        if self._unmade:
            self._writers.flush()
        attachment = self._next()
        if self._history is not None:
            self._history.keep(self._place, payload, attachment)
        self._publisher.put(payload, attachment)

    @property
    def _place(self) -> Place:
        """The place of the newest sample."""
        return self._writers.identity.epoch, self.sequence

    def put_deferred(self, make: Callable[[], bytes]) -> None:
        """Number and stamp the next sample now, and put what ``make`` returns when promises are kept.

        In lockstep it is put only if somebody subscribes; else it is made for a reader that asks for it.
        """
        writers = self._writers
        if writers.mute:
            return
        attachment = self._next()
        place = self._place
        self._unmade.add(place)
        writers.deferred.append(lambda: self._keep(place, attachment, make))
        if not writers.defers:
            writers.flush()

    def _keep(self, place: Place, attachment: bytes, make: Callable[[], bytes]) -> None:
        """Put what was promised; if that fails, a marker, so that nobody waits for it."""
        try:
            self._put_or_defer(place, attachment, make)
        finally:
            self._unmade.discard(place)

    def _put_or_defer(self, place: Place, attachment: bytes, make: Callable[[], bytes]) -> None:
        if self._writers.lockstep and self._history is not None and not self._is_subscribed():
            self._history.defer(place, make, attachment)
            return
        try:
            payload = make()
            if self._history is not None:
                self._history.keep(place, payload, attachment)
            self._publisher.put(payload, attachment)
        except Exception as error:
            self._writers.fault(self.key, error)
            with contextlib.suppress(BusError):
                self.mark()

    def _is_subscribed(self) -> bool:
        """Return whether somebody subscribes. A marker, which every new reader sees, has it asked again."""
        now = time.monotonic()
        if now > self._matched_until:
            self._matched, self._matched_until = self._publisher.matched, now + MATCH_INTERVAL
        return self._matched

    def _next(self) -> bytes:
        """Return the attachment of the next sample."""
        writers = self._writers
        if writers.lease is not None:
            writers.lease.check()
        if get_ident() != writers.thread:
            raise RuntimeError("publish from the component's own thread; let compute() return what is to be published")
        self.sequence = sequence = self.sequence + 1
        writers.advanced[self.key] = sequence
        return self._data + PLACE.pack(sequence, self._now()) + self._source

    def mark(self) -> None:
        """Put a marker: it states how far the numbering has come."""
        self._writers.flush()
        self._matched_until = 0.0
        self._declared.put(b"", self._marker + PLACE.pack(self.sequence, self._now()) + self._source)

    def keep_history(self) -> None:
        """Keep the last samples from now on, for readers that do not get them."""
        self._history = self._history or History()

    def resend(self, asked: Resend) -> Resent:
        """Return what is kept of the samples that a reader has not got; one that knows no epoch means the present."""
        present = self._writers.identity.epoch
        epoch = asked.epoch or present
        last = self.sequence if epoch == present else None
        if self._history is None:
            return Resent(last=last)
        wanted = epoch, asked.first, self.sequence if asked.last is None else asked.last
        self._make(self._history.take_deferred(*wanted))
        found = self._history.find(*wanted)
        return Resent(tuple(ResentSample(*sent, self.encoding) for sent in found), last)

    def newest(self) -> ResentSample | None:
        """Return the newest sample, None if it is large, still to be made, or not kept."""
        sent = self._history.at(self._place) if self._history is not None else None
        return ResentSample(*sent, self.encoding) if sent is not None and len(sent[0]) <= SMALL else None

    def is_making(self, asked: Resend) -> bool:
        """Return whether some of what is asked for has been numbered, and is still to be made."""
        return any(asked.first <= n and (asked.last is None or n <= asked.last) for _, n in self._unmade)

    def make_last_deferred(self) -> None:
        """Make the newest message that nobody has opened, while it can be made."""
        if self._history is not None:
            self._make(self._history.take_last_deferred())

    def _make(self, deferred: dict[Place, Deferred]) -> None:
        """Make messages for the history; one that cannot be made is reported, and lost."""
        self._unmade.update(deferred)
        for place, (make, attachment) in deferred.items():
            try:
                payload = make()
                if self._history is not None:
                    self._history.keep(place, payload, attachment)
            except Exception as error:
                self._writers.fault(self.key, error)
            finally:
                self._unmade.discard(place)

    @property
    def keeps_history(self) -> bool:
        """Whether its readers are to get every sample."""
        return self._history is not None

    @property
    def matched(self) -> bool:
        """Whether somebody subscribes."""
        return self._declared.matched

    def wait_for_reader(self, seconds: float) -> bool:
        """Wait until somebody subscribes: what is put at a fresh key before that may reach nobody."""
        self.fresh = False
        deadline = time.monotonic() + seconds
        while not self._publisher.matched:
            if time.monotonic() > deadline:
                return False
            time.sleep(MATCH_POLL)
        return True

    def close(self) -> None:
        """Undeclare the key; its numbering is remembered."""
        self._declared.close()


def _raise(_: str, error: BaseException) -> None:
    raise error


class Writers:
    """The writers of one component. ``advanced`` collects what was put or promised since it was last cleared.

    With ``keeps_history`` it can put again what readers of reliable keys, ``lockstep`` of all keys, have not got.
    While it ``defers``, deferred messages wait in ``deferred`` until `flush`; at other times they are put at once.
    Other work may wait there too. Nothing is put without a ``lease``, if there is one.
    """

    def __init__(
        self, bus: Bus, clock: Clock, identity: Identity, fault: Callable[[str, BaseException], None] | None = None
    ) -> None:
        """Start without keys; ``fault`` is called with the key of a deferred message that could not be made, and
        why.
        """
        self.bus = bus
        self.clock = clock
        self.identity = identity
        self.mute = False
        self.lease: HeldLease | None = None
        self.fault = fault or _raise
        self.defers = False
        self.keeps_history = self.lockstep = False
        self.deferred: deque[Callable[[], object]] = deque()
        self.advanced: dict[str, int] = {}
        self.open_keys: dict[str, Writer] = {}
        self._numbering: dict[str, int] = {}
        self._retired: dict[str, None] = {}
        self.thread = get_ident()

    def open(self, key: str, encoding: str, *, reliable: bool = True) -> Writer:
        """Declare a key to write, continuing with its numbering if it had one."""
        writer = self.open_keys.get(key)
        if writer is None:
            writer = Writer(self, key, encoding, self.bus.publisher(key, encoding, reliable=reliable))
            writer.sequence = self._numbering.get(key, 0)
            if self.keeps_history and (reliable or self.lockstep):
                writer.keep_history()
            self.open_keys[key] = writer
        return writer

    def resend(self, asked: Resend) -> Resent:
        """Return what is kept of the samples that a reader has not got."""
        self.flush()
        return self.resend_made(asked)

    def resend_made(self, asked: Resend) -> Resent:
        """Return the same without what is still to be made; from within a handler."""
        writer = self.open_keys.get(asked.key)
        return writer.resend(asked) if writer is not None else Resent()

    def is_making(self, asked: Resend) -> bool:
        """Return whether some of what is asked for is still to be made."""
        writer = self.open_keys.get(asked.key)
        return writer is not None and writer.is_making(asked)

    def newest(self, keys: Iterable[str]) -> dict[str, ResentSample]:
        """Return the newest samples of keys, without those that are large or still to be made."""
        found = {}
        for key in keys:
            writer = self.open_keys.get(key)
            if writer is not None and (sample := writer.newest()) is not None:
                found[key] = sample
        return found

    def mark_all(self, among: Container[str] | None = None) -> set[str]:
        """Report how far the numbering has come of each key whose readers are to get every sample, or ``among`` some.

        Returns the keys that nobody reads.
        """
        unread = set()
        for key, writer in self.open_keys.items():
            if writer.keeps_history and (among is None or key in among):
                if not writer.matched:
                    unread.add(key)
                writer.mark()
        return unread

    def flush(self) -> None:
        """Make and put what was promised, in its order."""
        while self.deferred:
            self.deferred.popleft()()

    def make_last_deferred(self) -> None:
        """Make the newest message of each key that nobody has opened: the component is about to stop."""
        self.flush()
        for writer in self.open_keys.values():
            writer.make_last_deferred()

    def close(self, key: str) -> None:
        """Undeclare a key."""
        self.flush()
        writer = self.open_keys.pop(key, None)
        if writer:
            self._numbering[key] = writer.sequence
            writer.close()

    def retire(self, key: str) -> None:
        """Undeclare the key of a client that has likely gone; the numbering is remembered of the last of them alone."""
        self.close(key)
        self._retired.pop(key, None)
        self._retired[key] = None
        if len(self._retired) > MAX_RETIRED:
            oldest = next(iter(self._retired))
            del self._retired[oldest]
            self._numbering.pop(oldest, None)

    def sequences(self) -> dict[str, int]:
        """Return the last sequence of every key."""
        return {key: writer.sequence for key, writer in self.open_keys.items()}

    def numbering(self) -> dict[str, int]:
        """Return the last sequence of every key ever written."""
        return self._numbering | self.sequences()

    def go_on_from(self, numbering: dict[str, int]) -> None:
        """Continue with numberings that may have come further elsewhere."""
        for key, sequence in numbering.items():
            self._numbering[key] = max(sequence, self._numbering.get(key, 0))
            if key in self.open_keys:
                self.open_keys[key].sequence = max(sequence, self.open_keys[key].sequence)

    def go_back_to(self, numbering: dict[str, int]) -> None:
        """Number again as of then: what was put meanwhile will be put again, and dropped as repeats."""
        self._numbering |= numbering
        for key in numbering.keys() & self.open_keys.keys():
            self.open_keys[key].sequence = numbering[key]

    def speak_as(self, identity: Identity, *, mute: bool = False) -> None:
        """Put as ``identity`` from now on; ``mute`` lets markers pass and everything else go nowhere."""
        self.flush()
        self.identity, self.mute = identity, mute
        for writer in self.open_keys.values():
            writer.speak()

    def close_all(self) -> None:
        """Undeclare every key."""
        for key in list(self.open_keys):
            self.close(key)
