"""An inbox that waits for sockets too."""

from __future__ import annotations

import os
import select
import socket
import threading
from collections.abc import Callable
from typing import Any

from regraft.bus.inbox import Alarm, Inbox


class SocketInbox(Inbox):
    """Items put by any thread, and what comes on sockets, which the taker itself reads.

    A thread for each socket would have to be woken, to wait for the interpreter, and to wake the taker.
    """

    def __init__(self) -> None:
        """Begin empty, without sockets."""
        super().__init__()
        self._waits = self._closed = False
        self._ringing = threading.Lock()
        self._bell = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._poll = select.epoll()
        self._poll.register(self._bell, select.EPOLLIN)
        self._ready: dict[int, Callable[[], Any]] = {}
        self.put = self._put_and_ring
        self._alarm = Alarm(self.put)

    def watch(self, end: socket.socket, ready: Callable[[], Any]) -> None:
        """Call ``ready`` whenever ``end`` can be read, and take what it returns for an item, unless that is None."""
        self._ready[end.fileno()] = ready
        self._poll.register(end, select.EPOLLIN)

    def forget(self, end: socket.socket) -> None:
        """Watch ``end`` no more, which is still open."""
        if self._ready.pop(end.fileno(), None) is not None:
            self._poll.unregister(end)

    def _wait(self) -> Any:
        """Wait for the next item or packet, or for the alarm."""
        self._waits = True  # from here on a put rings
        self._look(None if self._items.empty() else 0.0)
        self._waits = False
        return self._take_now()

    def close(self) -> None:
        """End the alarm, and close the sockets' watch: nobody waits here any more."""
        super().close()
        with self._ringing:
            self._closed = True
            self._poll.close()
            os.close(self._bell)

    def _put_and_ring(self, item: Any) -> None:
        self._items.put(item)
        if self._waits:
            with self._ringing:  # the taker may have been woken otherwise, and be closing
                if not self._closed:
                    os.eventfd_write(self._bell, 1)

    def _look(self, timeout: float | None) -> None:
        for descriptor, _ in self._poll.poll(timeout):
            if descriptor == self._bell:
                os.eventfd_read(self._bell)
            elif descriptor in self._ready:  # what was read before it may have ended it
                item = self._ready[descriptor]()
                if item is not None:
                    self._items.put(item)
