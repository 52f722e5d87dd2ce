"""The client's side of services and actions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys, service_name
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.component.errors import CallFailed
from regraft.component.future import Future
from regraft.component.goal import Goal
from regraft.runtime.core.timers import Timers
from regraft.runtime.data.inputs import Reporter
from regraft.runtime.data.writers import Writers

A = TypeVar("A")
F = TypeVar("F")

ASK_INTERVAL = 1_000_000_000
"""Nanoseconds of silence after which a request is repeated, under the same number."""
WAIT_FOR_SERVER = 0.2
MATCHED = {Answer.RESULT, Answer.CANCELLED, Answer.REFUSED, Answer.FAILED}


@dataclass(slots=True)
class Pending:
    """A request under way, as the client keeps it."""

    service: str
    request: Request
    reply: type
    feedback: type | None
    waiting: Future[Any]
    heard_at: int
    deadline: int | None
    accepted: Future[None]
    on_feedback: Callable[[Any], None] | None = None


class Caller:
    """All requests that one component has under way."""

    reliable = True
    paused = False

    def __init__(self, keys: Keys, client: str, writers: Writers, timers: Timers, reporter: Reporter) -> None:
        """Ask under the name ``client``, unique in the system."""
        self.client = client
        self._keys = keys
        self._writers = writers
        self._clock = writers.clock
        self._timers = timers
        self._reporter = reporter
        self._pending: dict[int, Pending] = {}
        self._number = 0

    @property
    def asked(self) -> int:
        """The number of the last request."""
        return self._number

    def go_on_from(self, number: int) -> None:
        """Number further requests from behind ``number``: up to there, others were made in this client's name."""
        self._number = max(self._number, number)

    def call(self, service: str, request: object, reply: type[A], timeout: float) -> Future[A]:
        """Ask a service; returns what its reply resolves, or CallFailed after ``timeout`` seconds."""
        pending = self._begin(service, Verb.CALL, request, reply, timeout)
        return pending.waiting

    def goal(
        self,
        service: str,
        goal: object,
        result: type[A],
        feedback: type[F] | None = None,
        accept_within: float = 5.0,
        on_feedback: Callable[[F], None] | None = None,
        *,
        outlives: bool = False,
    ) -> Goal[A, F]:
        """Give an action a goal; it fails if nobody accepts it in time."""
        pending = self._begin(service, Verb.GOAL, goal, result, accept_within, outlives=outlives)
        given: Goal[A, F] = Goal(pending.waiting, pending.accepted, lambda: self.cancel(pending))

        def heard(message: F) -> None:
            given.feedback = message
            if on_feedback:
                on_feedback(message)

        pending.feedback, pending.on_feedback = feedback, heard
        return given

    def _begin(
        self, service: str, verb: Verb, body: object, reply: type, timeout: float, *, outlives: bool = False
    ) -> Pending:
        service_name(service)
        self._number += 1
        plain = codec.to_plain(body)
        request = Request(self.client, self._number, verb, plain, timeout, outlives)
        now = self._clock.now()
        pending = Pending(service, request, reply, None, Future(), now, now + round(timeout * 1e9), Future())
        self._pending[self._number] = pending
        self._send(service, request)
        self._watch(pending)
        return pending

    def _send(self, service: str, request: Request) -> None:
        writer = self._writers.open(self._keys.request(service), type_of(Request).encoding)
        if writer.fresh:
            writer.wait_for_reader(WAIT_FOR_SERVER)
        writer.put(codec.encode(request))

    def cancel(self, pending: Pending) -> None:
        """Ask a service to end a goal; one that was not accepted yet is given up at once, and not asked for again."""
        if pending.waiting.done:
            return
        self._send(pending.service, replace(pending.request, verb=Verb.CANCEL, body=None))
        if not pending.accepted.done:
            self._end(pending, CallFailed(pending.service, Answer.CANCELLED, "cancelled before it was accepted"))

    def cancel_all(self) -> None:
        """End every goal under way that does not outlive this run, and forget all requests."""
        for pending in list(self._pending.values()):
            if pending.request.verb is Verb.GOAL and not pending.request.outlives:
                self.cancel(pending)
            self._end(pending, CallFailed(pending.service, None, "the client stopped waiting"))

    # --- silence: ask again, and give up at the deadline ---

    def _watch(self, pending: Pending) -> None:
        then = pending.heard_at + ASK_INTERVAL
        if pending.deadline is not None:
            then = min(then, pending.deadline)
        self._timers.sleep_until(then).when_done(lambda: self._silent(pending))

    def _silent(self, pending: Pending) -> None:
        if pending.waiting.done:
            return
        now = self._clock.now()
        if pending.deadline is not None and now >= pending.deadline:
            self._end(pending, CallFailed(pending.service, None, self._why_silent(pending)))
            return
        if now - pending.heard_at >= ASK_INTERVAL:
            pending.heard_at = now
            again = Verb.RESULT if pending.accepted.done else pending.request.verb
            self._send(pending.service, replace(pending.request, verb=again))
        self._watch(pending)

    def _why_silent(self, pending: Pending) -> str:
        writer = self._writers.open(self._keys.request(pending.service), type_of(Request).encoding)
        patience = f"{pending.request.patience:g} s"
        if not writer.matched:
            return f"nobody offers this service (waited {patience})"
        return f"no answer within {patience}"

    # --- as a consumer of replies ---

    def deliver(self, sample: Sample) -> None:
        """Take a reply in its turn."""
        try:
            reply = codec.decode(sample.payload, Reply)
        except BadMessage as error:
            self.refuse(Envelope.from_bytes(sample.attachment).source, str(error))
            return
        pending = self._pending.get(reply.number)
        if pending is None:
            return
        pending.heard_at = self._clock.now()
        try:
            self._take(pending, reply)
        except BadMessage as error:
            self.refuse(Envelope.from_bytes(sample.attachment).source, str(error))
            self._end(pending, CallFailed(pending.service, Answer.FAILED, f"sent a reply that does not fit: {error}"))

    def _take(self, pending: Pending, reply: Reply) -> None:
        if reply.answer is Answer.ACCEPTED:
            pending.deadline = None
            pending.accepted.resolve(None)
        elif reply.answer is Answer.FEEDBACK:
            if pending.feedback is not None and pending.on_feedback is not None:
                pending.on_feedback(codec.from_plain(reply.body, pending.feedback))
        elif reply.answer is Answer.RESULT:
            self._end(pending, None, codec.from_plain(reply.body, pending.reply))
        else:
            self._end(pending, CallFailed.by(pending.service, reply))

    def _end(self, pending: Pending, error: CallFailed | None, value: Any = None) -> None:
        self._pending.pop(pending.request.number, None)
        if error:
            pending.waiting.fail(error)
        else:
            pending.waiting.resolve(value)

    def refuse(self, source: str, why: str) -> None:
        """Count and report a reply that cannot be handled."""
        self._reporter.refused("reply", source, why)

    def report_lost(self, source: str, count: int) -> None:
        """Count and report replies that never came."""
        self._reporter.lost("replies", source, count)
