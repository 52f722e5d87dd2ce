"""Confirms connections between members: their writers put markers until every reader has seen them."""

from __future__ import annotations

import time
from collections.abc import Callable

from regraft.bus_schema.messages.protocol.clock import MarkerAck
from regraft.lockstep.membership import Membership, Pair
from regraft.lockstep.source_inbox import SourceInbox
from regraft.patience import Patience
from regraft.runtime.runtime import Runtime

MARK_INTERVAL = 0.1
WIRED_TIMEOUT = 5.0


class Markers:
    """The markers that are under way. A declaration alone is no barrier: what is put early may reach nobody.

    Args:
        runtime: of the source, which is a member too.
        membership: who is connected to whom.
        inbox: where members' answers come in.
        have_put: has other members put markers at keys, and waits until they have.
        confirmed: called with the key of each connection that is confirmed.
    """

    def __init__(
        self,
        runtime: Runtime,
        membership: Membership,
        inbox: SourceInbox,
        have_put: Callable[[dict[str, set[str]]], None],
        confirmed: Callable[[str], None],
    ) -> None:
        self._runtime = runtime
        self._membership = membership
        self._inbox = inbox
        self._have_put = have_put
        self._confirmed = confirmed
        self._waiting: set[Pair] = set()

    def take_ack(self, ack: MarkerAck) -> None:
        """Take the news that a member has seen a marker."""
        reader = self._membership.members.get(ack.member)
        pair = (ack.key, ack.source, ack.member)
        if reader is not None and reader.incarnation == ack.incarnation and pair in self._waiting:
            self._waiting.discard(pair)
            self._membership.confirm(pair, ack.sequence)
            self._confirmed(ack.key)

    def saw(self, key: str, source: str, stream: object) -> None:
        """Take the news that the source itself has seen a marker."""
        assignment, handled = self._runtime.assignment, getattr(stream, "handled", 0) or 0
        self.take_ack(MarkerAck(assignment.name, assignment.incarnation, key, source, handled))

    def forget(self, name: str) -> None:
        """Wait for the connections of a member no longer."""
        self._waiting = {pair for pair in self._waiting if name not in pair[1:]}

    def confirm_all(self) -> list[Pair]:
        """Have markers put until every connection is confirmed; returns those that are not within a bound."""
        if not self._membership.unwired():
            return []
        within = Patience(WIRED_TIMEOUT)
        while unwired := self._membership.unwired():
            if within.is_over():
                self._give_up(unwired)
                return sorted(unwired)
            self._waiting = unwired
            by_writer: dict[str, set[str]] = {}
            for key, writer, _ in unwired:
                by_writer.setdefault(writer, set()).add(key)
            for key in by_writer.pop(self._runtime.assignment.name, ()):
                self._runtime.writers.open_keys[key].mark()
            self._have_put(by_writer)
            self._inbox.pump_until(lambda: not self._waiting, time.monotonic() + MARK_INTERVAL)
        return []

    def _give_up(self, unwired: set[Pair]) -> None:
        for key, writer, reader in sorted(unwired):
            self._runtime.reporter.event("clock.unwired", f"{reader} never saw a marker of {writer} on {key}")
            self._membership.wired.add((key, writer, reader))
