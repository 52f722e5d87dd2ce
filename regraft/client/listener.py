"""The thread of a client: takes what the bus brings and hands it on."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from regraft.bus.inbox import Inbox
from regraft.bus.interface import Bus, Closable, Sample

LOG = logging.getLogger("regraft.client")
LOOK_AROUND = 0.2
"""Seconds between looks at requests that have met with silence."""
LOOK_AWAY = 1.0
"""The same while replies wait to be read: who asks again before it has heard makes a slow service slower."""
LEAVE_TIMEOUT = 1.0
MAX_WAITING = 10_000
"""Samples that may wait to be handled; under a flood, later ones are dropped."""
_Waiting = tuple[Callable[[Sample], object], Callable[[], object], Any]
"""A handler, the function in its place for a sample that cannot be opened, and the raw sample."""


class _Subscribed:
    """A subscription of a listener, which knows it until it is closed."""

    def __init__(self, inner: Closable, forget: Callable[[_Subscribed], object]) -> None:
        self._inner = inner
        self._forget = forget

    def close(self) -> None:
        self._inner.close()
        self._forget(self)


class Listener:
    """Opens samples and calls their handlers one at a time, so that no handler runs on a network thread.

    Handlers of lazy samples may run on any other thread, next to one of the others. They must not call `take_lazy`.
    """

    def __init__(self, bus: Bus, name: str, tick: Callable[[], object]) -> None:
        """Start the thread; ``tick`` is called several times a second, or once where much is to be handled."""
        self._bus = bus
        self._tick = tick
        self._inbox = Inbox()
        self._lazy: deque[_Waiting] = deque()
        self._taking = threading.Lock()
        self._stopped = False
        self._open: set[_Subscribed] = set()
        self._thread = threading.Thread(target=self._run, name=f"client {name}", daemon=True)
        self._thread.start()

    def subscribe(
        self,
        key: str,
        handler: Callable[[Sample], object],
        admit: Callable[[], bool] = lambda: True,
        missed: Callable[[], object] = lambda: None,
        *,
        lazy: bool = False,
    ) -> Closable:
        """Have ``handler`` called with every sample whose key matches and that ``admit`` lets in.

        A ``lazy`` one wakes nobody: it waits for the next sample that does, for a look around, or for `take_lazy`.

        ``admit`` runs on the network thread, before the sample is opened: it bounds what waits. ``missed`` is called
        for one that cannot be opened: its writer has taken it back.
        """

        waiting, put = (self._lazy.__len__, self._lazy.append) if lazy else (self._inbox.qsize, self._inbox.put)

        def sink(item: Any) -> None:
            if waiting() < MAX_WAITING and admit():
                put((handler, missed, item))

        subscribed = _Subscribed(self._bus.subscribe(key, sink), self._open.discard)
        self._open.add(subscribed)
        return subscribed

    @property
    def is_here(self) -> bool:
        """Whether the caller is on the listener's own thread."""
        return threading.current_thread() is self._thread

    def stop(self) -> None:
        """Close all subscriptions and end the thread, within bounds; a handler that hangs dies with the process."""
        for subscribed in tuple(self._open):
            subscribed.close()
        self._stopped = True
        self._inbox.put(None)
        self._inbox.close()
        if not self.is_here:
            self._thread.join(LEAVE_TIMEOUT)

    def take_lazy(self) -> None:
        """Handle what has woken nobody, on any thread; in its order, as others wait until it is done."""
        with self._taking:
            for _ in range(len(self._lazy)):
                self._handle(*self._lazy.popleft())

    def _run(self) -> None:
        looked = time.monotonic()
        while not self._stopped:
            item: _Waiting | None = self._inbox.get(LOOK_AROUND)
            self.take_lazy()
            if item is not None:
                self._handle(*item)
            if time.monotonic() - looked >= (LOOK_AROUND if self._inbox.empty() else LOOK_AWAY):
                self._tick()
                looked = time.monotonic()

    def _handle(self, handler: Callable[[Sample], object], missed: Callable[[], object], raw: Any) -> None:
        sample = self._bus.open_sample(raw)
        if sample is None:
            missed()
            return
        try:
            handler(sample)
        except Exception:
            LOG.exception("a callback for %s failed", sample.key)
