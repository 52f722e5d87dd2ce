"""A bus within one process, for fast tests: the same promises as the real one, delivered at once, in order."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from regraft.bus.interface import Answer, BusError, Presence, Sample, Sink
from regraft.bus_schema.keys import matches


@dataclass(eq=False, slots=True)
class _Declared:
    """A declaration that knows the list that it is in."""

    key: str
    sink: Sink
    listed_in: list[_Declared]
    of_session: list[_Declared]
    on_close: Callable[[], None] | None = None

    def close(self) -> None:
        if self in self.listed_in:
            self.listed_in.remove(self)
            self.of_session.remove(self)
            if self.on_close:
                self.on_close()


@dataclass(slots=True)
class MemoryQuery:
    """A query on the memory bus."""

    key: str
    payload: bytes
    answers: list[Answer] = field(default_factory=list)
    answered: threading.Event = field(default_factory=threading.Event)

    def reply(self, payload: bytes, *, error: bool = False) -> None:
        """Answer; a second answer is ignored."""
        if not self.answered.is_set():
            self.answers.append(Answer(self.key, payload, error))
            self.answered.set()

    def drop(self) -> None:
        """Leave it to others to answer."""
        self.answered.set()


@dataclass(slots=True)
class MemoryHub:
    """The state that all sessions of one memory bus share."""

    lock: threading.RLock = field(default_factory=threading.RLock)
    subscriptions: list[_Declared] = field(default_factory=list)
    queryables: list[_Declared] = field(default_factory=list)
    tokens: list[_Declared] = field(default_factory=list)
    watchers: list[_Declared] = field(default_factory=list)

    def deliver(self, listed: list[_Declared], key: str, item: object) -> int:
        """Hand ``item`` to every declaration that matches ``key``; returns how many there were."""
        with self.lock:
            hit = [declared for declared in listed if matches(declared.key, key)]
            for declared in hit:
                declared.sink(item)
        return len(hit)


@dataclass(slots=True)
class _MemoryPublisher:
    bus: MemoryBus
    key: str
    encoding: str
    closed: bool = False

    def put(self, payload: bytes, attachment: bytes) -> None:
        if self.closed or self.bus.closed:
            raise BusError(f"the publisher of {self.key} is closed")
        self.bus.hub.deliver(self.bus.hub.subscriptions, self.key, Sample(self.key, payload, attachment, self.encoding))

    @property
    def matched(self) -> bool:
        return any(matches(declared.key, self.key) for declared in self.bus.hub.subscriptions)

    def close(self) -> None:
        self.closed = True


class MemoryBus:
    """One session on a memory hub."""

    def __init__(self, hub: MemoryHub) -> None:
        """Join ``hub``."""
        self.hub = hub
        self.closed = False
        self._mine: list[_Declared] = []

    def _declare(
        self, listed: list[_Declared], key: str, sink: Sink, on_close: Callable[[], None] | None = None
    ) -> _Declared:
        if self.closed:
            raise BusError("the session is closed")
        declared = _Declared(key, sink, listed, self._mine, on_close)
        with self.hub.lock:
            listed.append(declared)
        self._mine.append(declared)
        return declared

    def publisher(self, key: str, encoding: str, *, reliable: bool) -> _MemoryPublisher:
        """Declare a publisher; on this bus every one is reliable."""
        return _MemoryPublisher(self, key, encoding)

    def subscribe(self, key: str, sink: Sink) -> _Declared:
        """Hand matching samples to ``sink``."""
        return self._declare(self.hub.subscriptions, key, sink)

    def serve(self, key: str, sink: Sink) -> _Declared:
        """Hand matching queries to ``sink``."""
        return self._declare(self.hub.queryables, key, sink)

    def open_sample(self, item: Any) -> Sample | None:
        """Return the item if it is a sample."""
        return item if type(item) is Sample else None

    def open_query(self, item: Any) -> MemoryQuery | None:
        """Return the item if it is a query."""
        return item if type(item) is MemoryQuery else None

    def query(self, key: str, payload: bytes, timeout: float, *, all_of_them: bool = False) -> list[Answer]:
        """Ask everybody whose key matches, and wait."""
        queries: list[MemoryQuery] = []
        with self.hub.lock:
            for declared in [d for d in self.hub.queryables if matches(key, d.key)]:
                query = MemoryQuery(key, payload)
                queries.append(query)
                declared.sink(query)
        deadline = time.monotonic() + timeout
        for query in queries:
            query.answered.wait(max(0.0, deadline - time.monotonic()))
            if query.answers and not all_of_them:
                return list(query.answers)
        return [answer for query in queries for answer in query.answers]

    def ask(self, key: str, payload: bytes, timeout: float, done: Callable[[list[Answer]], object]) -> None:
        """Ask on a thread of its own."""
        threading.Thread(target=lambda: done(self.query(key, payload, timeout)), daemon=True).start()

    def announce(self, key: str) -> _Declared:
        """Declare a token and notify the watchers."""
        token = self._declare(
            self.hub.tokens,
            key,
            lambda _: None,
            lambda: self._tell(Presence(key, present=False)),
        )
        self._tell(Presence(key, present=True))
        return token

    def _tell(self, presence: Presence) -> None:
        self.hub.deliver(self.hub.watchers, presence.key, presence)

    def watch(self, key: str, sink: Callable[[Presence], object]) -> _Declared:
        """Hand presence to ``sink``, tokens already there first."""
        with self.hub.lock:
            for token in self.present(key, 0.0):
                sink(Presence(token, present=True))
            return self._declare(self.hub.watchers, key, sink)

    def present(self, key: str, timeout: float) -> list[str]:
        """Return the matching tokens."""
        return [token.key for token in self.hub.tokens if matches(key, token.key)]

    def when_renewed(self, call: Callable[[], object]) -> None:
        """Do nothing: links of this bus do not break."""

    def close(self) -> None:
        """Undeclare everything."""
        self.closed = True
        for declared in list(self._mine):
            declared.close()
