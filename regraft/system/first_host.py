"""The first host of a system as one sees it that joins: it is asked for a proof, and to take the host in."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from regraft.bus.interface import Answer, Bus, BusError
from regraft.bus.zenoh_config import Tls
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.joining import HostProof, JoinedSystem, JoinHost, RenewLease
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.host.joining.leaving import announce
from regraft.process.shutdown import ShutdownRequest
from regraft.runtime.core.lease import now
from regraft.security.host_proof import NotProved, Seal, prove

ANSWER_TIMEOUT = 3.0
LINK_TIMEOUT = 10.0
"""Seconds that the link between the hubs may take to come up."""
RETRY_INTERVAL = 0.1
"""Seconds between two questions: nothing shows when the link between the hubs is up, or a lost name is free."""

Told = TypeVar("Told", JoinedSystem, HostProof)


class CannotJoin(Exception):
    """The system does not take the host in; the text states why and what would be right."""


class NothingThere(Exception):
    """Nobody answers at the endpoint, or not any more."""


@dataclass(frozen=True, slots=True)
class FirstHost:
    """The first host at the other end of a bus. A signal interrupts each wait for it: KeyboardInterrupt."""

    bus: Bus
    keys: Keys
    ending: ShutdownRequest

    def prove(self, tls: Tls | None, host: str, instance: str) -> Seal:
        """Prove which host this is, if it has a certificate. Raises BusError, NothingThere, CannotJoin."""
        if tls is None:
            return Seal()
        try:
            with self.ending.interrupting():
                return prove(tls, host, instance, lambda flight: self._asked("prove", lambda: flight, HostProof))
        except NotProved as error:
            raise CannotJoin(str(error)) from None

    def join(self, wanted: JoinHost, seal: Seal) -> tuple[JoinedSystem, float]:
        """Join for good; returns the answer, and when it was asked for (s, of the leases' clock).

        Raises:
            KeyboardInterrupt: a signal came. The first host may have taken the host in, so it is notified.
            BusError, NothingThere, CannotJoin: it was not taken in.
        """
        asked_at = 0.0

        def question() -> JoinHost:
            nonlocal asked_at
            asked_at = now()
            return seal.on(wanted)

        try:
            with self.ending.interrupting():
                joined = self._asked("join", question, JoinedSystem)
        except KeyboardInterrupt:
            with contextlib.suppress(BusError):  # without a link it counts as lost, and the interrupt stands
                announce(self.bus, self.keys, lambda: seal.on(RenewLease(wanted.host, wanted.instance, leaving=True)))
            raise
        return joined, asked_at

    def _asked(self, verb: str, question: Callable[[], object], kind: type[Told]) -> Told:
        """Return what it answers, as soon as the link between the hubs is there."""
        key, deadline = self.keys.host(LOCAL, verb), time.monotonic() + LINK_TIMEOUT
        while True:
            answers = self.bus.query(key, codec.encode(question()), ANSWER_TIMEOUT)
            told = read_answer(answers[0], kind) if answers else "the first host does not answer any more"
            if not isinstance(told, str):
                return told
            if time.monotonic() > deadline:
                raise NothingThere(told)
            time.sleep(RETRY_INTERVAL)


def read_answer(answer: Answer, kind: type[Told]) -> Told | str:
    """Return the first host's answer, or why one has to wait; raises CannotJoin."""
    try:
        if not answer.error:
            return codec.decode(answer.payload, kind)
        refusal = codec.decode(answer.payload, ControlError)
    except BadMessage as error:
        raise CannotJoin(f"its answer cannot be read, it may be of another version of Regraft: {error}") from None
    if refusal.code is ControlCode.TIMED_OUT:
        return "; ".join(refusal.problems)
    raise CannotJoin("; ".join(refusal.problems))
