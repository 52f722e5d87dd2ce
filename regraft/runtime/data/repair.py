"""Asks writers for samples that have not come: what a link or a full queue has lost is sent again.

A link that breaks loses what is under way on it. A payload in shared memory can be taken back while its reader is kept
from running. Neither is a fault of the component, so neither may cost it a message.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from regraft.bus.interface import Answer, Bus, BusError, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import Resend, Resent
from regraft.patience import Patience, stretched
from regraft.runtime.data.stream import Stream

ANSWER_TIMEOUT = 1.0
RETRY_INTERVAL = 0.25
NO_WRITER_TIMEOUT = 1.0
"""Seconds for which a writer that is not reached is tried: its link may be being opened again."""
CATCH_UP_TIMEOUT = 6.0
"""Seconds for which writers are asked for what was lost with a link: one that has gone keeps nobody waiting."""
GIVE_UP_TIMEOUT = 6.0
"""Seconds after which a writer that is there and does not answer is given up: it may be in a long step."""
REST = 5.0
"""Seconds for which a component that cannot keep up asks for nothing again."""

Pair = tuple[str, str]
"""A key and a source."""


@dataclass(slots=True)
class _Attempt:
    """One hole that is being closed; ``asked`` is in monotonic seconds."""

    first: int
    last: int
    asked: float = 0.0
    hopeless: bool = False
    of_any_run: bool = False
    doubted: frozenset[int] = frozenset()
    reached: Patience = field(default_factory=lambda: Patience(NO_WRITER_TIMEOUT))
    answered: Patience = field(default_factory=lambda: Patience(GIVE_UP_TIMEOUT))


class Repair:
    """The holes of one component that are being closed. ``post`` has something called on its thread."""

    def __init__(self, bus: Bus, keys: Keys, name: str, post: Callable[[Callable[[], object]], object]) -> None:
        self._bus = bus
        self._keys = keys
        self._post = post
        self._log = logging.getLogger(name)
        self._attempts: dict[Pair, _Attempt] = {}
        self._rests_until = 0.0
        self.arrive: Callable[[Sample], object] = lambda _: None
        self.strike: Callable[[str, str, int, frozenset[int]], object] = lambda *_: None

    def may_come(self, pair: Pair, stream: Stream, first: int, last: int) -> bool:
        """Return whether missing samples may still come, and ask for them if it is time to."""
        now = time.monotonic()
        attempt = self._attempts.get(pair)
        if attempt is None or (attempt.first, attempt.last) != (first, last):
            attempt = self._attempts[pair] = _Attempt(first, last)
        if attempt.hopeless or attempt.answered.is_over() or now < self._rests_until:
            del self._attempts[pair]
            return False
        if now - attempt.asked > RETRY_INTERVAL:
            attempt.asked = now
            self._ask(pair, stream, attempt)
        return True

    def rest(self) -> None:
        """Ask for nothing for a while: this component has let messages go by, since it cannot keep up."""
        self._rests_until = time.monotonic() + REST

    def forget(self, pair: Pair) -> None:
        """Nothing is missing any more."""
        self._attempts.pop(pair, None)

    def _ask(self, pair: Pair, stream: Stream, attempt: _Attempt) -> None:
        began = time.monotonic()

        def done(answers: list[Answer]) -> None:
            waited = time.monotonic() - began
            self._post(lambda: self._take(pair, attempt, answers, is_there=waited >= ANSWER_TIMEOUT))

        attempt.doubted = frozenset((*stream.waiting, stream.marked))
        attempt.of_any_run = attempt.of_any_run or not stream.incarnation
        try:
            key, asked = self._question(pair, stream, attempt.first, attempt.last, of_any_run=attempt.of_any_run)
            self._bus.ask(key, asked, ANSWER_TIMEOUT, done)
        except SchemaError:
            attempt.hopeless = True  # the source is no component
        except BusError as error:
            self._log.warning("%s", error)

    def _question(
        self, pair: Pair, stream: Stream, first: int, last: int | None, *, of_any_run: bool = False
    ) -> tuple[str, bytes]:
        key = self._keys.control(pair[1], "*" if of_any_run else stream.incarnation, "resend")
        return key, codec.encode(Resend(pair[0], stream.epoch, first, last))

    def _take(self, pair: Pair, attempt: _Attempt, answers: list[Answer], *, is_there: bool) -> None:
        """Take the answers. Without one, a writer that ``is_there`` is busy, and another one is not reached."""
        if self._attempts.get(pair) is not attempt:
            return
        if not answers:
            attempt.hopeless = not is_there and attempt.reached.is_over()
            attempt.of_any_run = attempt.of_any_run or not is_there  # another run may have taken over
            return
        resent = self._resent(pair, answers[0])
        sequences = self._arrived(pair, resent)
        attempt.hopeless = attempt.first not in sequences
        if resent.last is not None:
            self.strike(*pair, resent.last, attempt.doubted)

    def _resent(self, pair: Pair, answer: Answer) -> Resent:
        try:
            return codec.decode(answer.payload, Resent) if not answer.error else Resent()
        except BadMessage as error:
            self._log.warning("%s, sent again by %s: %s", *pair, error)
            return Resent()

    def _arrived(self, pair: Pair, resent: Resent) -> set[int]:
        """Take what was sent again as if it came now; returns its sequences."""
        try:
            samples = [Sample(pair[0], s.payload, s.attachment, s.encoding) for s in resent.samples]
            sequences = {Envelope.from_bytes(sample.attachment).sequence for sample in samples}
        except BadMessage as error:
            self._log.warning("%s, sent again by %s: %s", *pair, error)
            return set()
        if samples:
            self._log.info("%s: %d samples of %s did not come and were sent again", pair[0], len(samples), pair[1])
        for sample in samples:
            self.arrive(sample)
        return sequences

    def catch_up(self, streams: dict[Pair, Stream]) -> None:
        """Ask for all that was put behind what is known of these streams: the link was broken meanwhile."""
        questions = []
        for pair, stream in streams.items():
            try:
                questions.append((pair, *self._question(pair, stream, (stream.handled or 0) + 1, None)))
            except SchemaError:
                continue  # the source is no component
        threading.Thread(target=self._ask_all, args=(questions,), name="catch-up", daemon=True).start()

    def _ask_all(self, questions: list[tuple[Pair, str, bytes]]) -> None:
        """Ask all of them, and again who did not answer: the writer's link may be broken, too, or it has gone."""
        pause, patience = threading.Event(), Patience(CATCH_UP_TIMEOUT)
        while questions and not patience.is_over():
            questions = [question for question in questions if not self._is_answered(*question)]
            if questions:
                pause.wait(stretched(RETRY_INTERVAL))

    def _is_answered(self, pair: Pair, key: str, asked: bytes) -> bool:
        """Ask one question; returns whether it need not be asked again."""
        try:
            answers = self._bus.query(key, asked, ANSWER_TIMEOUT)
        except BusError:
            return True
        for answer in answers[:1]:
            self._post(partial(self._arrived, pair, self._resent(pair, answer)))
        return bool(answers)
