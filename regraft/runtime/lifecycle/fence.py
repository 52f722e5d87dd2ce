"""The fence of one component: it takes changes from the adaptation manager's current term only."""

from __future__ import annotations

from regraft.bus.interface import BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.host import HostStatus
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.core.terms import Fenced, in_force
from regraft.runtime.parts import Parts

HOST_ANSWER_TIMEOUT = 0.3
"""Seconds that a host may take to answer which term has begun: less than a heartbeat may stay away."""


class Fence:
    """The fence of one component. It begins with the assignment's term, which a later one replaces."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._term = parts.assignment.term

    def check(self, term: int | None) -> None:
        """Refuse a change of a previous term; raises ControlRefused."""
        if self._term is None:
            return
        known = self._term_of_a_host() if term is not None and term > self._term else None
        try:
            self._term = in_force(term, self._term, known)
        except Fenced as error:
            raise ControlRefused(ControlCode.FENCED, str(error)) from None

    def _term_of_a_host(self) -> int | None:
        """Return the term that a host knows: a manager notifies hosts first. None if no host answers."""
        parts = self._parts
        try:
            answers = parts.bus.query(parts.keys.host("*", "runs"), b"", HOST_ANSWER_TIMEOUT)
            return next((codec.decode(a.payload, HostStatus).term for a in answers if not a.error), None)
        except (BusError, BadMessage):
            return None
