"""Gets the messages that an input opens, where it reads on demand: from their writers, which make them only then.

In simulated time a step has how far a writer has come. So readers know of a message without getting it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from regraft.bus.inbox import Inbox
from regraft.bus.interface import Answer, Bus, BusError, Query, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Resend, Resent
from regraft.patience import Patience
from regraft.runtime.data.repair import ANSWER_TIMEOUT, NO_WRITER_TIMEOUT, RETRY_INTERVAL

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


@dataclass(slots=True, eq=False)
class _Question:
    """One question. It lies in the inbox when it is answered; nothing is left to do about one that comes too late."""

    answers: list[Answer] = field(default_factory=list)

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
        asked = codec.encode(Resend(wanted.key, 0, envelope.sequence, envelope.sequence))
        try:
            answer = self._ask(self._keys.control(envelope.source, "*", "resend"), asked)
            if answer is None:
                raise BusError("no answer")
            resent = codec.decode(answer.payload, Resent) if not answer.error else Resent()
        except (SchemaError, BusError) as error:
            self._error = self._error or f"{wanted.key} of {envelope.source}, {envelope.sequence}: {error}"
            return None
        found = next(iter(resent.samples), None)
        return Sample(wanted.key, found.payload, found.attachment, found.encoding) if found else None

    def _ask(self, key: str, asked: bytes) -> Answer | None:
        within, reached = Patience(GIVE_UP_TIMEOUT), Patience(NO_WRITER_TIMEOUT)
        set_aside: list[Any] = []
        try:
            while not within.is_over():
                began, question = time.monotonic(), _Question()
                self._bus.ask(key, asked, ANSWER_TIMEOUT, partial(self._note, question))
                if self._wait(question, set_aside, ANSWER_TIMEOUT + RETRY_INTERVAL):
                    return question.answers[0]
                if time.monotonic() - began < ANSWER_TIMEOUT:  # there is nobody to ask
                    if reached.is_over():
                        return None
                    self._wait(_Question(), set_aside, RETRY_INTERVAL)
            return None
        finally:
            self._inbox.put_back(set_aside)

    def _note(self, question: _Question, answers: list[Answer]) -> None:
        question.answers += answers
        self._inbox.put(question)

    def _wait(self, question: _Question, set_aside: list[Any], seconds: float) -> bool:
        """Wait until a question is answered, and return whether it was; everything else is set aside.

        The answer to another question is for a fetch in the middle of which this one began.
        """
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            item = self._inbox.get(min(left, self._beat_if_due()))
            if item is question:
                return bool(question.answers)
            if item is None:
                continue
            query = self._bus.open_query(item)
            if query is None or not query.key.endswith(RESEND) or not self.answer(query):
                set_aside.append(item)
        return False
