"""Gets the messages that an input opens, where it reads on demand: from their writers, which make them only then.

In simulated time a step has how far a writer has come. So readers know of a message without getting it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from regraft.bus.inbox import Inbox
from regraft.bus.interface import Answer, Bus, BusError, Query, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Resend, Resent
from regraft.patience import Patience

ANSWER_TIMEOUT = 1.0
RETRY_INTERVAL = 0.25
NO_WRITER_TIMEOUT = 1.0
"""Seconds for which a writer that is not reached is tried: its link may be being opened again."""
GIVE_UP_TIMEOUT = 8.0
"""Seconds after which a writer that does not answer is given up: it may be in a long step."""
RESEND = "/resend"
NO_STAMP = 0


def notice(key: str, source: str, sequence: int) -> Sample:
    """Return what stands for a message of a source until it is fetched: a sample without a payload."""
    return Sample(key, b"", Envelope(source, 0, 0, sequence, NO_STAMP).to_bytes(), "")


def is_notice(sample: Sample) -> bool:
    """Return whether a sample stands for one that is to be fetched."""
    return not sample.payload


@dataclass(slots=True)
class _Answered:
    """Lies in the inbox where a question was answered; nothing is left to do about one that comes too late."""

    answers: list[Answer]

    def __call__(self) -> None:
        pass


class Fetching:
    """The messages that one component fetches, one at a time, on its thread.

    Everything else that arrives meanwhile is handled afterwards. Only others that fetch from this component are
    answered at once, unless they want what is being made: two that fetch from each other would wait for ever.
    """

    def __init__(self, bus: Bus, keys: Keys, inbox: Inbox, beat_if_due: Callable[[], float]) -> None:
        """``beat_if_due`` keeps the heartbeat, and returns the seconds until it is due again."""
        self._bus = bus
        self._keys = keys
        self._inbox = inbox
        self._beat_if_due = beat_if_due
        self._error = ""
        self.answer: Callable[[Query], bool] = lambda _: False

    def take_error(self) -> str:
        """Return what has not come since the last call, for people; empty if all has come."""
        error, self._error = self._error, ""
        return error

    def fetch(self, wanted: Sample) -> Sample | None:
        """Return the message that a notice stands for; None if its writer has it no longer, or gives no answer."""
        envelope = Envelope.from_bytes(wanted.attachment)
        question = codec.encode(Resend(wanted.key, 0, envelope.sequence, envelope.sequence))
        try:
            resent = self._ask(self._keys.control(envelope.source, "*", "resend"), question)
        except (SchemaError, BusError):
            resent = None
        if resent is None:
            self._error = self._error or f"{wanted.key} of {envelope.source}, {envelope.sequence}: no answer"
            return None
        found = next(iter(resent.samples), None)
        return Sample(wanted.key, found.payload, found.attachment, found.encoding) if found else None

    def _ask(self, key: str, question: bytes) -> Resent | None:
        within, reached = Patience(GIVE_UP_TIMEOUT), Patience(NO_WRITER_TIMEOUT)
        set_aside: list[Any] = []
        try:
            while not within.is_over():
                asked = time.monotonic()
                self._bus.ask(key, question, ANSWER_TIMEOUT, lambda found: self._inbox.put(_Answered(found)))
                resent = self._resent(self._wait(set_aside, ANSWER_TIMEOUT + RETRY_INTERVAL))
                if resent is not None:
                    return resent
                is_there = time.monotonic() - asked >= ANSWER_TIMEOUT
                if not is_there and reached.is_over():
                    return None
                self._wait(set_aside, RETRY_INTERVAL if not is_there else 0.0)
            return None
        finally:
            self._inbox.put_back(set_aside)

    def _wait(self, set_aside: list[Any], seconds: float) -> list[Answer]:
        """Return the answers, none if there are none in time; what else arrives is set aside."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            item = self._inbox.get(min(left, self._beat_if_due()))
            if type(item) is _Answered:
                return item.answers
            if item is None:
                continue
            query = self._bus.open_query(item)
            if query is None or not query.key.endswith(RESEND) or not self.answer(query):
                set_aside.append(item)
        return []

    @staticmethod
    def _resent(answers: list[Answer]) -> Resent | None:
        for answer in answers:
            try:
                return codec.decode(answer.payload, Resent) if not answer.error else Resent()
            except BadMessage:
                return Resent()
        return None
