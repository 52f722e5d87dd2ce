"""Where everything that reaches a component waits for its thread."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any


class Inbox:
    """Items in the order of their arrival: put from any thread, taken by one.

    A wait with a time-out has the kernel set a timer, which costs a fifth of a round trip. A component waits after
    every message, so another thread, the alarm, keeps the time. It is woken only when something is due earlier than its
    present setting. A wait may end early with nothing.

    No wait carries a time-out of its own: before Python 3.13, ``SimpleQueue.get(timeout=...)`` waits for ever if its
    thread is held up in it until the time is over.

    A lazy item is taken like the rest, but wakes nobody, since nothing can be done about it yet. An ``eager`` taker is
    woken. It comes behind what was put, whichever came first.
    """

    def __init__(self) -> None:
        """Begin empty; a None in it is the alarm, or a request to end the waiting."""
        self._items: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._lazy: deque[Any] = deque()
        self._returned: deque[Any] = deque()
        self._alarm = Alarm(self._items.put)
        self.eager = False
        self.put: Callable[[Any], object] = self._items.put

    def put_lazy(self, item: Any) -> None:
        """Put an item that need not be taken before something else is."""
        self._lazy.append(item)
        # A reader that becomes eager takes the lazy items afterwards, so that one of the two sees the other.
        if self.eager:
            self.put(None)

    def empty(self) -> bool:
        """Return whether nothing is there."""
        return not self._returned and not self._lazy and self._items.empty()

    def qsize(self) -> int:
        """Return how many items are there."""
        return len(self._returned) + len(self._lazy) + self._items.qsize()

    def get(self, timeout: float) -> Any:
        """Return the next item; None if there is none within ``timeout`` seconds, or earlier."""
        return self.get_until(time.monotonic() + timeout) if timeout > 0.0 else self._take_now()

    def get_until(self, then: float) -> Any:
        """Return the next item; None if there is none until ``then`` (monotonic seconds), or earlier."""
        if self._returned or self._lazy:
            return self._take_now()
        if self._alarm.set_to > then:
            if then <= time.monotonic():
                return self._take_now()
            self._alarm.set(then)
        return self._wait()

    def _wait(self) -> Any:
        """Wait for the next item, or for the alarm's None."""
        return self._items.get()

    def put_back(self, items: Iterable[Any]) -> None:
        """Have items that were taken, and could not be handled yet, come before all others."""
        self._returned.extend(items)

    def close(self) -> None:
        """End the alarm: nobody waits here any more."""
        self._alarm.stop()

    def take_lazy(self) -> Iterator[Any]:
        """Take the lazy items that are there now."""
        for _ in range(len(self._lazy)):
            yield self._lazy.popleft()

    def _take_now(self) -> Any:
        if self._returned:
            return self._returned.popleft()
        item = None
        try:
            while item is None:  # the alarm's Nones are among the items
                item = self._items.get_nowait()
        except queue.Empty:
            pass
        return self._lazy.popleft() if item is None and self._lazy else item


class Alarm:
    """Puts a None at the earliest of the times (monotonic seconds) that it was set to since it last did.

    Its thread starts when it is first set.
    """

    def __init__(self, ring: Callable[[None], object]) -> None:
        self.set_to = math.inf
        self._ring = ring
        self._told = threading.Condition()
        self._started = self._stopped = False

    def set(self, then: float) -> None:
        """Ring at ``then``, which is earlier than what it is set to."""
        if not self._started:
            self._started = True
            threading.Thread(target=self._run, name="alarm", daemon=True).start()
        with self._told:
            self.set_to = then
            self._told.notify()

    def stop(self) -> None:
        """End the thread."""
        with self._told:
            self._stopped = True
            self._told.notify()

    def _run(self) -> None:
        with self._told:
            while not self._stopped:
                left = self.set_to - time.monotonic()
                if left > 0.0:
                    self._told.wait(left if left < math.inf else None)
                else:
                    self.set_to = math.inf
                    self._ring(None)
