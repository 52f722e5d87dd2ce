"""An inbox that waits for sockets too."""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from typing import Any

from regraft.bus.inbox import Alarm, Inbox


class SocketInbox(Inbox):
    """Items put by any thread, and what comes on sockets: these are read by the thread that takes the items.

    A thread of its own for each socket would have to be woken, wait for the interpreter, and wake the taker.
    """

    def __init__(self) -> None:
        """Begin empty, without sockets."""
        super().__init__()
        self._waits = False
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

    def get_until(self, then: float) -> Any:
        """Return the next item; None if there is none until ``then`` (monotonic seconds), or earlier."""
        if self._returned or self._lazy:
            return self._take_now()
        if self._alarm.set_to > then:
            if then <= time.monotonic():
                return self._take_now()
            self._alarm.set(then)
        self._waits = True  # from here on whoever puts something rings
        self._look(None if self._items.empty() else 0.0)
        self._waits = False
        return self._take_now()

    def close(self) -> None:
        """End the alarm, and close the sockets' watch: nobody waits here any more."""
        super().close()
        self._poll.close()
        os.close(self._bell)

    def _put_and_ring(self, item: Any) -> None:
        self._items.put(item)
        if self._waits:
            os.eventfd_write(self._bell, 1)

    def _look(self, timeout: float | None) -> None:
        for descriptor, _ in self._poll.poll(timeout):
            if descriptor == self._bell:
                os.eventfd_read(self._bell)
            elif descriptor in self._ready:  # what was read before it may have ended it
                item = self._ready[descriptor]()
                if item is not None:
                    self._items.put(item)
