"""A client's connection: what a request knows of it, and for how long the gateway waits for the client."""

from __future__ import annotations

import asyncio
import fcntl
import struct
import termios
from typing import Any, Final

from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from regraft.patience import stretched

CONNECTION: Final = "regraft.connection"
"""Where a request's scope has the server's end of its connection."""
REQUEST_TIMEOUT: Final = 5.0
"""Seconds that a client has for a whole request, from its first byte or from the connection on."""
READING_TIMEOUT: Final = 10.0
"""Seconds for which a client may take nothing of an answer that waits for it."""
MAX_CONNECTIONS: Final = 128
"""Connections at a time: for another one, the oldest that waits for its client is closed."""


class KnownConnection(H11Protocol):
    """HTTP on one connection, which its requests can look at; one that stays silent locks nobody out."""

    _request_due: asyncio.TimerHandle | None = None
    _reading_due: asyncio.TimerHandle | None = None
    _has_ended = False
    made = 0.0
    """When the connection was made (s, of the event loop's clock)."""

    def connection_made(self, transport: Any) -> None:
        """Give each request the connection."""
        super().connection_made(transport)
        self.made = self.loop.time()
        self._make_room()
        self._watch()
        app: ASGIApp = self.app
        connection = transport.get_extra_info("socket")

        async def known(scope: Scope, receive: Receive, send: Send) -> None:
            scope[CONNECTION] = connection
            await app(scope, receive, send)

        self.app = known

    def data_received(self, data: bytes) -> None:
        """Take what has come."""
        super().data_received(data)
        self._watch()

    def pause_writing(self) -> None:
        """Wait for the client to read."""
        super().pause_writing()
        if self._reading_due is None:
            self._await_reading()

    def resume_writing(self) -> None:
        """Send on."""
        super().resume_writing()
        self._reading_due = _cancelled(self._reading_due)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing more."""
        super().connection_lost(exc)
        self._has_ended = True
        self._request_due = _cancelled(self._request_due)
        self._reading_due = _cancelled(self._reading_due)

    @property
    def _awaits_request(self) -> bool:
        """Whether no request has come, or only a part of one."""
        cycle = self.cycle
        return cycle is None or self._was_answered or bool(cycle.more_body)

    @property
    def _was_answered(self) -> bool:
        """Whether the last request was answered: its client may well have another one."""
        return self.cycle is not None and self.cycle.response_complete

    def _make_room(self) -> None:
        """End the oldest connections that wait for their clients, or this one, until there are few enough.

        Those go first that were never answered.
        """
        there = [each for each in self.connections if isinstance(each, KnownConnection) and not each._has_ended]
        waiting = [each for each in there if each is not self and (each._awaits_request or each._reading_due)]
        waiting.sort(key=lambda each: (each._was_answered, each.made))
        for each in [*waiting, self][: max(0, len(there) - MAX_CONNECTIONS)]:
            each._end()

    def _end(self) -> None:
        self._has_ended = True
        self.transport.abort()

    def _await_reading(self) -> None:
        self._reading_due = self.loop.call_later(stretched(READING_TIMEOUT), self._judge_reading, self._left())

    def _judge_reading(self, left: int) -> None:
        """End the connection, unless less is left to be taken than was.

        The server writes an answer as a whole, and hears nothing until nearly all of it is taken.
        """
        if self._left() < left:
            self._await_reading()
        else:
            self._end()

    def _left(self) -> int:
        """Return the bytes that the client has not taken: the server's, and those that the kernel has of it.

        The kernel may keep 4 MB, and takes more from the server only once a third of it has gone.
        """
        connection = self.transport.get_extra_info("socket")
        (unsent,) = struct.unpack("i", fcntl.ioctl(connection.fileno(), termios.TIOCOUTQ, bytes(4)))
        return self.transport.get_write_buffer_size() + int(unsent)

    def _watch(self) -> None:
        if not self._awaits_request:
            self._request_due = _cancelled(self._request_due)
        elif self._request_due is None:
            self._request_due = self.loop.call_later(stretched(REQUEST_TIMEOUT), self._end)


def _cancelled(timer: asyncio.TimerHandle | None) -> asyncio.TimerHandle | None:
    """Cancel a timer; returns that there is none."""
    if timer is not None:
        timer.cancel()
    return None
