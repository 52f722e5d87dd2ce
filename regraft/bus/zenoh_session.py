"""A Zenoh session that outlives its link: what was declared on it is declared again on the next."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import zenoh

CLOSE_TIMEOUT = 2.0
"""Seconds that closing a session may take; a lossy link can hold it for ten (eclipse-zenoh/zenoh #2675)."""
NEXT_TRY = 0.1
"""Seconds between attempts to reach a hub that is gone."""

Make = Callable[[zenoh.Session], Any]


@dataclass(slots=True, eq=False)
class Declared:
    """Something declared; ``inner`` is what represents it on the session of now, None while there is none.

    It can be closed twice, and after its session.
    """

    session: LastingSession
    make: Make
    inner: Any = None

    def close(self) -> None:
        """Undeclare it."""
        self.session.forget(self)
        if self.inner is not None:
            with contextlib.suppress(zenoh.ZError):
                self.inner.undeclare()


class LastingSession:
    """A session, and another with all its declarations when its link to the hub broke.

    Zenoh mends a broken link by itself, under the same identity, often while the hub still holds the old link. A busy
    hub then takes the new link for the old one and forgets it. The link stays open, and nothing, or only a part of what
    was declared, passes (seen with Zenoh 1.10.2). A session of a new identity is not mistaken.
    """

    def __init__(self, session: zenoh.Session, again: Callable[[], zenoh.Session] | None = None) -> None:
        """Take over an open session; ``again`` opens the next one, None where Zenoh's own mending is enough."""
        self.now = session
        self._again = again
        self._broken: zenoh.Session | None = None
        self._declared: dict[Declared, None] = {}
        self._changing = threading.Lock()
        self._renewing = threading.Lock()
        self._ending = threading.Lock()
        self._closed = threading.Event()
        self._renewal: threading.Thread | None = None
        self.when_renewed: list[Callable[[], object]] = []
        self._look_after(session)

    @property
    def broken(self) -> bool:
        """Whether there is no link now: what is put is lost, what is asked not answered."""
        return self._broken is self.now

    def declare(self, make: Make) -> Declared:
        """Declare it on this session and on every later one; raises ZError if it cannot be."""
        declared = Declared(self, make)
        with self._changing:
            if not self.broken:
                declared.inner = make(self.now)
            self._declared[declared] = None
        return declared

    def forget(self, declared: Declared) -> None:
        """Declare it no more."""
        with self._changing:
            self._declared.pop(declared, None)

    def close(self) -> None:
        """Close it for good, bounded: what does not close in time dies with the process."""
        with self._ending:  # a renewal that has begun is known here, and none begins later
            if self._closed.is_set():
                return
            self._closed.set()
        if self._renewal is not None:
            # A process that ends while a thread opens a session is aborted.
            self._renewal.join(CLOSE_TIMEOUT)
        _close(self.now)

    def _look_after(self, session: Any) -> None:
        if self._again is None:
            return

        def heard(event: Any) -> None:
            if event.kind == zenoh.SampleKind.DELETE:
                self._lost(session)

        session.info.declare_transport_events_listener(zenoh.handlers.Callback(heard, indirect=False))
        if not session.info.transports():
            self._lost(session)

    def _lost(self, session: zenoh.Session) -> None:
        with self._ending:
            if session is self.now and not self._closed.is_set():
                self._broken = session
                self._renewal = threading.Thread(target=self._renew, args=(session,), name="zenoh-renewal", daemon=True)
                self._renewal.start()

    def _renew(self, broken: zenoh.Session) -> None:
        with self._renewing:
            if broken is not self.now:
                return
            _close(broken)
            while not self._closed.is_set() and not self._renewed():
                self._closed.wait(NEXT_TRY)
            if self._closed.is_set():
                _close(self.now)

    def _renewed(self) -> bool:
        assert self._again is not None
        try:
            session = self._again()
        except zenoh.ZError:
            return False
        with self._changing:
            try:
                made = [(declared, declared.make(session)) for declared in self._declared]
            except zenoh.ZError:
                _close(session)
                return False
            for declared, inner in made:
                declared.inner = inner
            self.now = session
        self._look_after(session)
        for call in self.when_renewed:
            call()
        return True


def _close(session: zenoh.Session) -> None:
    closing = threading.Thread(target=_close_quietly, args=(session,), daemon=True)
    closing.start()
    closing.join(CLOSE_TIMEOUT)


def _close_quietly(session: Any) -> None:
    with contextlib.suppress(zenoh.ZError):
        session.close()
