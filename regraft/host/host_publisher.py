"""The host's publications: its status, events, and its refusals."""

from __future__ import annotations

import logging
from typing import Any

from regraft.bus.interface import Bus, BusError, Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import Diagnostic, Event, Level
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.host import HostStatus
from regraft.runtime.core.clock import Clock
from regraft.runtime.data.writers import Identity, Writers


class UnknownComponent(Exception):
    """The host has no component of that name."""


class Refused(Exception):
    """A refused request; the text states why."""

    def __init__(self, text: str, code: ControlCode = ControlCode.REFUSED) -> None:
        self.code = code
        super().__init__(text)


class HostPublisher:
    """Puts a host's status and events on the bus; one that cannot be put is only in the log."""

    def __init__(self, bus: Bus, keys: Keys, host: str, clock: Clock) -> None:
        self._keys = keys
        self._host = host
        self._clock = clock
        self._writers = Writers(bus, clock, Identity(f"host-{host}", 1, 1))
        self._log = logging.getLogger("host")

    def status(self, status: HostStatus) -> None:
        """Report how the host and its processes are."""
        self._put(self._keys.host(self._host, "status"), status)

    def event(self, kind: str, subject: str, text: str, **details: Any) -> None:
        """Report what has happened, to the log too."""
        self._log.warning("%s", text)
        self._put(self._keys.event, Event(self._clock.now() / 1e9, kind, subject, text, details))

    def diagnose(self, component: str, subject: str, level: Level, text: str) -> None:
        """Put a diagnostic about a component that cannot speak for itself."""
        diagnostic = Diagnostic(self._clock.now() / 1e9, component, subject, level, text)
        self._put(self._keys.diagnostics, diagnostic)

    def _put(self, key: str, message: object) -> None:
        try:
            self._writers.open(key, type_of(type(message)).encoding).put(codec.encode(message))
        except BusError as error:
            self._log.warning("%s", error)


def refuse(query: Query, code: ControlCode, why: str) -> None:
    """Answer a query with why it is not done."""
    query.reply(codec.encode(ControlError(code, (why,))), error=True)
