"""The latest events, numbered, for any number of readers at their own pace.

Readers share one bounded buffer: one that is too slow gets the number of missed events, and costs no memory.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import threading
from collections import deque
from collections.abc import AsyncIterator
from dataclasses import dataclass

from regraft.bus_schema.messages.health import Event
from regraft.dashboard_api.http.bus_types import to_json
from regraft.dashboard_api.http.problems import unavailable

MAX_KEPT = 1000
MAX_READERS = 32


@dataclass(frozen=True, slots=True)
class Numbered:
    """An event with its place in the gateway's numbering, as JSON text."""

    number: int
    kind: str
    text: str


def _one_word(kind: str) -> str:
    """Return a kind that cannot break out of its line of the stream."""
    return "".join(c if c.isalnum() or c in "._-" else "_" for c in kind)[:100] or "event"


class EventBuffer:
    """Filled from any thread, read from the server's event loop."""

    def __init__(self, size: int = MAX_KEPT) -> None:
        """Begin a numbering of its own: identifiers of another gateway's run are not mistaken for this one's."""
        self.run = secrets.token_hex(4)
        self._lock = threading.Lock()
        self._kept: deque[Numbered] = deque(maxlen=size)
        self._last = 0
        self._readers: dict[asyncio.Event, asyncio.AbstractEventLoop] = {}
        self._beside: list[EventBuffer] = []
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether no more events will come."""
        return self._closed

    @property
    def readers(self) -> int:
        """How many are reading."""
        return len(self._readers)

    @property
    def last(self) -> int:
        """The number of the latest event."""
        return self._last

    def add(self, event: Event) -> None:
        """Keep an event and wake the readers."""
        self.add_message(event.kind, event)

    def add_message(self, kind: str, message: object) -> None:
        """Keep any message as an event of a kind, and wake the readers."""
        text = json.dumps(to_json(message))
        with self._lock:
            self._last += 1
            self._kept.append(Numbered(self._last, _one_word(kind), text))
        self._wake()

    def restart(self) -> None:
        """Forget all and begin a new numbering; only while nobody reads."""
        with self._lock:
            self.run = secrets.token_hex(4)
            self._kept.clear()
            self._last = 0

    def beside(self) -> EventBuffer:
        """Return another buffer, which is closed with this one."""
        other = EventBuffer()
        self._beside.append(other)
        return other

    def close(self) -> None:
        """Send the readers home."""
        self._closed = True
        self._wake()
        for other in self._beside:
            other.close()

    def _wake(self) -> None:
        with self._lock:
            readers = list(self._readers.items())
        for woken, loop in readers:
            with contextlib.suppress(RuntimeError):
                loop.call_soon_threadsafe(woken.set)

    async def reading(self) -> AsyncIterator[asyncio.Event]:
        """Give one more reader, until its answer has ended, what is set when there is something new; raises Problem."""
        woken = asyncio.Event()
        with self._lock:
            if len(self._readers) >= MAX_READERS:
                raise unavailable(f"{MAX_READERS} readers are being sent these events already")
            self._readers[woken] = asyncio.get_running_loop()
        try:
            yield woken
        finally:
            with self._lock:
                del self._readers[woken]

    def after(self, number: int) -> tuple[list[Numbered], int]:
        """Return the events behind ``number``, and how many of them are kept no more."""
        with self._lock:
            first = self._kept[0].number if self._kept else self._last + 1
            missed = max(0, first - number - 1)
            return [event for event in self._kept if event.number > number], missed

    def identifier(self, number: int) -> str:
        """Return the identifier that a reader gets, and gives back as ``Last-Event-ID``."""
        return f"{self.run}-{number}"

    def resume(self, identifier: str) -> int | None:
        """Return the number that a reader had come to: the latest for a new one, None for a foreign identifier."""
        if not identifier:
            return self._last
        run, _, number = identifier.rpartition("-")
        if run != self.run or not (number.isascii() and number.isdecimal() and len(number) < 19):
            return None
        return min(int(number), self._last)
