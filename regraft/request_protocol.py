"""The client's side of services and actions, without a clock and without a bus.

A component's client and a tool's client add time, waiting and sending. The messages are those of
``regraft.bus_schema.messages.protocol.requests``.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import service_name
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.component.errors import CallFailed
from regraft.component.future import Future

A = TypeVar("A")
Read = Callable[[PlainValue], Any]

ASK_INTERVAL = 1_000_000_000
"""Nanoseconds of silence after which a request is repeated, under the same number."""
MAX_UNANSWERED = 30
"""Repetitions without a reply after which an accepted goal counts as lost: nobody offers its service."""


@dataclass(slots=True, eq=False)
class PendingRequest:
    """A request under way. ``heard_at`` (ns) is the time of its latest reply or repetition; ``unanswered`` counts the
    repetitions since its latest reply that nobody was seen to get.

    ``read`` and ``read_feedback`` make messages of plain data, or raise BadMessage. Without ``read_feedback``, feedback
    is ignored. ``unoffered`` means that no component offered the service at the last look.
    """

    service: str
    request: Request
    heard_at: int
    read: Read
    read_feedback: Read | None = None
    on_feedback: Callable[[Any], object] | None = None
    accepted: Future[None] = field(default_factory=Future)
    outcome: Future[Any] = field(default_factory=Future)
    feedback: Any = None
    unoffered: bool = False
    unanswered: int = 0

    def under(self, verb: Verb) -> Request:
        """Return the request that refers to this one by its number: ``cancel`` or ``result``."""
        return replace(self.request, verb=verb, body=None)


class RequestProtocol(ABC):
    """All requests that one client has under way. ``asked`` is the number of the last one. Thread-safe."""

    def __init__(self, client: str) -> None:
        """Ask under the name ``client``, unique in the system."""
        self.client = client
        self.asked = 0
        self._lock = threading.Lock()
        self._pending: dict[int, PendingRequest] = {}
        self._closed = False

    @abstractmethod
    def send(self, pending: PendingRequest, request: Request) -> None:
        """Put a request at the key of the service."""

    def begin(
        self,
        verb: Verb,
        service: str,
        body: PlainValue,
        patience: float,
        now: int,
        read: Read,
        read_feedback: Read | None = None,
        on_feedback: Callable[[Any], object] | None = None,
        *,
        outlives: bool = False,
    ) -> PendingRequest:
        """Number a request and send it. Raises CallFailed once closed, and the errors of ``send``."""
        service_name(service)
        with self._lock:
            if self._closed:
                raise CallFailed(service, None, "the client is closed")
            self.asked += 1
            request = Request(self.client, self.asked, verb, body, patience, outlives)
            pending = PendingRequest(service, request, now, read, read_feedback, on_feedback)
            self._pending[request.number] = pending
        try:
            self.send(pending, request)
        except BaseException:
            self._pending.pop(request.number, None)
            raise
        return pending

    def take(self, payload: bytes, now: int) -> str | None:
        """Take an encoded reply; return why it does not fit. A reply to a request that has ended is ignored."""
        try:
            reply = codec.decode(payload, Reply)
        except BadMessage as error:
            return str(error)
        pending = self._pending.get(reply.number)
        if pending is None:
            return None
        pending.heard_at, pending.unanswered = now, 0
        try:
            value = _read(pending, reply)
        except BadMessage as error:
            why = f"sent a reply that does not fit: {error}"
            if reply.answer is Answer.FEEDBACK:
                self._end_and_cancel(pending, Answer.FAILED, why)
            else:
                self.end(pending, CallFailed(pending.service, Answer.FAILED, why))
            return str(error)
        self._take(pending, reply, value)
        return None

    def _take(self, pending: PendingRequest, reply: Reply, value: Any) -> None:
        if reply.answer is Answer.RESULT:
            self.end(pending, None, value)
        elif reply.answer is Answer.FEEDBACK:
            if pending.read_feedback is not None:
                pending.feedback = value
                if pending.on_feedback is not None:
                    pending.on_feedback(value)
        elif reply.answer is not Answer.ACCEPTED:
            self.end(pending, CallFailed.by(pending.service, reply))
        elif pending.request.verb is Verb.GOAL:
            pending.accepted.resolve(None)

    def repeat_if_silent(self, pending: PendingRequest, now: int, *, offered: bool | None = None) -> None:
        """Ask again after silence, or at once when the service is ``offered`` again; end a goal that nobody pursues.

        Silence of who offers the service is no loss: it is in a long step, or time stands. ``offered`` is None where
        that is not known.
        """
        has_come_back = offered is True and pending.unoffered
        pending.unoffered = offered is False
        if not has_come_back and now - pending.heard_at < ASK_INTERVAL:
            return
        if pending.accepted.done and pending.unanswered >= MAX_UNANSWERED:
            why = f"whoever had accepted it is gone: no reply to {MAX_UNANSWERED} questions for its result"
            self._end_and_cancel(pending, Answer.ACCEPTED, why)
            return
        pending.heard_at = now
        if not offered:
            pending.unanswered += 1
        self.send(pending, pending.under(Verb.RESULT) if pending.accepted.done else pending.request)

    def give_up(self, pending: PendingRequest, *, offered: bool) -> None:
        """End a request that was not answered within its patience."""
        patience = f"{pending.request.patience:g} s"
        why = f"no answer within {patience}" if offered else f"nobody offers this service (waited {patience})"
        self._end_and_cancel(pending, None, why)

    def _end_and_cancel(self, pending: PendingRequest, answer: Answer | None, why: str) -> None:
        """End a request. A goal is cancelled, too: a server that is late, or comes back, must not pursue it."""
        self.end(pending, CallFailed(pending.service, answer, why))
        if pending.request.verb is Verb.GOAL:
            self.send(pending, pending.under(Verb.CANCEL))

    def cancel(self, pending: PendingRequest) -> None:
        """Ask for the end of a goal; one that is not accepted yet ends at once, and is not asked for again."""
        if pending.outcome.done:
            return
        self.send(pending, pending.under(Verb.CANCEL))
        if not pending.accepted.done:
            self.end(pending, CallFailed(pending.service, Answer.CANCELLED, "cancelled before it was accepted"))

    def end(self, pending: PendingRequest, error: CallFailed | None, value: Any = None) -> None:
        """End a request; the first end counts."""
        if self._pending.pop(pending.request.number, None) is None:
            return  # of two threads one takes it out
        if error is not None:
            pending.outcome.fail(error)
        else:
            pending.outcome.resolve(value)

    def under_way(self) -> list[PendingRequest]:
        """Return the requests that have not ended, in the order of their numbers."""
        return list(self._pending.copy().values())  # another thread may end one meanwhile

    def close(self) -> None:
        """End all requests; further ones fail."""
        with self._lock:
            self._closed = True
        for pending in self.under_way():
            self.end(pending, CallFailed(pending.service, None, "the client was closed"))


def _read(pending: PendingRequest, reply: Reply) -> Any:
    """Return what a reply holds, None if nobody reads that; raises BadMessage."""
    if reply.answer is Answer.RESULT:
        return pending.read(reply.body)
    if reply.answer is Answer.FEEDBACK and pending.read_feedback is not None:
        return pending.read_feedback(reply.body)
    return None


def reader(cls: type[A]) -> Callable[[PlainValue], A]:
    """Return the function that makes a ``cls`` of plain data, or raises BadMessage."""
    return lambda plain: codec.from_plain(plain, cls)
